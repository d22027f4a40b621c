# SPDX-License-Identifier: Apache-2.0
"""The loop over scenes, scenarios and methods."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from ...types.errors import MfoError
from ...types.status import Status
from ..rows.method import is_quick
from ..rows.row import Row, Task
from ..rows.row_file import RowFile


class Runner(Protocol):
    """Measures one task; tests give one that needs no renderer."""

    size: int

    def __call__(self, task: Task, should_stop: Callable[[], bool]) -> Row:
        """The row, its status `cancelled` where it was asked to stop before the end."""
        ...


def all_tasks(scenarios: Iterable[str], methods: Sequence[str], scenes: int) -> list[Task]:
    """Quick methods first, then scene by scene, so that a bench that ends early has as many scenes everywhere.

    A scene's methods follow each other: what else the machine does then disturbs them alike.
    """
    names = list(scenarios)
    rounds = [[m for m in methods if is_quick(m)], [m for m in methods if not is_quick(m)]]
    return [
        Task(scenario, scene, method)
        for chosen in rounds
        for scene in range(scenes)
        for scenario in names
        for method in chosen
    ]


def run_bench(
    tasks: Sequence[Task],
    file: RowFile,
    runner: Runner,
    *,
    machine: Mapping[str, Any],
    listener: Callable[[Row], None],
    should_stop: Callable[[], bool],
    log: Callable[[str], None] = lambda text: None,
) -> bool:
    """Measure the tasks that have no row yet and append a row for each; what raises is a row with its error.

    Returns False if it was asked to stop. A run that was cut short leaves no row and is done again by the next bench.
    """
    done = {row.key for row in file.read()}
    for task in tasks:
        if task.key in done:
            continue
        if should_stop():
            return False
        row = measured_row(task, lambda task=task: runner(task, should_stop), runner.size, log)
        if row.status == Status.CANCELLED.value or (row.error and should_stop()):
            return False
        row = replace(row, machine=dict(machine))
        file.append(row)
        listener(row)
    return True


def measured_row(
    task: Task, measure: Callable[[], Row], size: int, log: Callable[[str], None] = lambda text: None
) -> Row:
    """The row of a task, or one with the error that was raised."""
    try:
        return measure()
    except Exception as error:
        log(traceback.format_exc())
        return failed_row(task, size, error)


def failed_row(task: Task, size: int, error: BaseException) -> Row:
    """The row of a task that raised."""
    status = error.status if isinstance(error, MfoError) else Status.FAILED
    words = " ".join(str(error).split())
    sentence = words if isinstance(error, MfoError) else f"{type(error).__name__}: {words}"
    return Row(
        scenario=task.scenario,
        scene=task.scene,
        method=task.method,
        seed=task.scene,
        size=size,
        status=status.value,
        error=sentence[:400],
    )
