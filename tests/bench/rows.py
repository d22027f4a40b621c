# SPDX-License-Identifier: Apache-2.0
"""Rows without a renderer."""

from __future__ import annotations

from collections.abc import Callable

from mfo_backend.bench.row import Row, Task
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

    def seed(self, task: Task) -> int:
        return task.scene

    def __call__(self, task: Task, should_stop: Callable[[], bool]) -> Row:
        self.asked.append(task)
        if task in self._broken:
            raise self._broken[task]
        return row(task, status=Status.CANCELLED.value if task == self._cancelled else Status.CONVERGED.value)
