# SPDX-License-Identifier: Apache-2.0
"""Rows without a renderer."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

from mfo_backend.bench.rows.row import Row, Task
from mfo_backend.types.status import Status


def row(task: Task, **values) -> Row:
    common = {"seed": task.scene, "size": 16, "status": Status.CONVERGED.value, "seconds": 2.0, "passes": 30.0}
    common |= {"flip": 0.01, "hdr_flip": 0.02, "relative_rmse": 0.005, "relit_relative_rmse": 0.006}
    common |= {"start_flip": 0.5, "floor_flip": 0.001, "reference_flip": 0.011, "floor_relative_rmse": 0.002}
    return Row(task.scenario, task.scene, task.method, **(common | values))


class FakeRunner:
    """Counts what it is asked for; raises for the tasks in `broken`, is cut short at the task `cancelled`."""

    size = 16

    def __init__(self, broken: dict[Task, Exception] | None = None, cancelled: Task | None = None) -> None:
        self.asked: list[Task] = []
        self._broken = broken or {}
        self._cancelled = cancelled

    def __call__(self, task: Task, should_stop: Callable[[], bool], pictures=None) -> Row:
        self.asked.append(task)
        if task in self._broken:
            raise self._broken[task]
        return row(task, status=Status.CANCELLED.value if task == self._cancelled else Status.CONVERGED.value)

    def pictures(self, task: Task) -> str:
        return f"{task.scenario} {task.scene}"


@dataclass(frozen=True)
class FakeRecipe:
    """A runner for workers; it waits, notes every task in a file of its process, and kills its process for `deadly`."""

    folder: str
    seconds: float = 0.0
    deadly: Task | None = None
    size: int = 16

    def make(self):
        return NotingRunner(self), {"threads": 1}


class NotingRunner(FakeRunner):
    def __init__(self, recipe: FakeRecipe) -> None:
        super().__init__()
        self._recipe = recipe

    def __call__(self, task: Task, should_stop: Callable[[], bool], pictures=None) -> Row:
        assert pictures == f"{task.scenario} {task.scene}"
        with open(f"{self._recipe.folder}/asked-{os.getpid()}", "a") as file:
            file.write(f"{task.key}\n")
        time.sleep(self._recipe.seconds)
        if task == self._recipe.deadly:
            os._exit(9)
        return super().__call__(task, should_stop)
