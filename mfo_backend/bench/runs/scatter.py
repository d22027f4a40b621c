# SPDX-License-Identifier: Apache-2.0
"""The bench on Dask workers: the same rows as in one process, written by one process.

The true pictures of a scene are a task of their own; every method's task depends on them and so, mostly, runs where
they are. A worker that is lost costs its unfinished tasks, which other workers do again.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from ...job.cluster import RETRIES, as_they_come
from ...types.errors import SetupError
from ..rows.row import Row, Task
from ..rows.row_file import RowFile
from .run_bench import Runner, failed_row, measured_row


class Recipe(Protocol):
    """Makes a runner in a worker; equal recipes share one."""

    @property
    def size(self) -> int:
        """Width and height of the pictures."""
        ...

    def make(self) -> tuple[Runner, dict[str, Any]]:
        """The runner and the facts of its machine."""
        ...


@dataclass(frozen=True)
class FitRecipe:
    """Makes a `FitRunner` with the same assets as the client's; pictures are kept where the folder can be reached."""

    size: int
    manifest: tuple[tuple[str, tuple[str, ...]], ...]
    pictures: str
    threads: int = 0

    def make(self) -> tuple[Runner, dict[str, Any]]:
        """See `Recipe.make`.

        Raises
        ------
        SetupError
            If this worker has other objects, probes or materials: its scenes would be others.
        """
        from ..scenes.assets import Assets
        from .fit_runner import FitRunner
        from .machine import machine_facts

        assets = Assets.find()
        here = {name: tuple(values) for name, values in assets.manifest().items()}
        differing = [name for name, values in self.manifest if here[name] != values]
        if differing:
            raise SetupError(f"This worker has other {' and '.join(differing)}: give every worker the same MFO_DATA.")
        kept = Path(self.pictures) if Path(self.pictures).is_dir() else None
        runner = FitRunner(Path(tempfile.mkdtemp(prefix="mfo-bench-")), self.size, assets, kept, threads=self.threads)
        return runner, machine_facts(runner.variant, threads=runner.threads, import_seconds=runner.import_seconds)


_ALL_DIED = "Every worker that tried this task has died."
_DIED = f"{RuntimeError.__name__}: {_ALL_DIED}"  # as its row says it
_RUNNERS: dict[Any, tuple[Any, dict[str, Any]]] = {}  # of this process


def _runner(recipe: Recipe) -> tuple[Any, dict[str, Any]]:
    if recipe not in _RUNNERS:
        _RUNNERS[recipe] = recipe.make()
    return _RUNNERS[recipe]


def true_pictures(recipe: Recipe, task: Task) -> Any:
    """In a worker: the pictures every method of the task's scene is judged by."""
    return _runner(recipe)[0].pictures(task)


def measure(recipe: Recipe, task: Task, pictures: Any) -> Row:
    """In a worker: the task's row, with its error if it raises."""
    runner, machine = _runner(recipe)
    return replace(measured_row(task, lambda: runner(task, lambda: False, pictures), runner.size), machine=machine)


def run_scattered(
    tasks: Sequence[Task],
    file: RowFile,
    client: Any,
    recipe: Recipe,
    *,
    listener: Callable[[Row], None],
    should_stop: Callable[[], bool],
) -> bool:
    """As `run_bench`, on the workers of a Dask client. What is unfinished when it stops leaves no row.

    Dask blames every task that a worker had when it died. Those it gives up are tried again, one at a time.
    """
    done = {row.key for row in file.read()}
    left = [task for task in tasks if task.key not in done]
    suspects: list[Task] = []

    def add(task: Task, row: Row) -> None:
        file.append(row)
        listener(row)

    def add_or_suspect(task: Task, row: Row) -> None:
        if row.error == _DIED:
            suspects.append(task)
        else:
            add(task, row)

    finished = _measured(left, client, recipe, add_or_suspect, should_stop)
    for task in suspects:
        finished = finished and _measured([task], client, recipe, add, should_stop)
    return finished


def _measured(
    tasks: Sequence[Task],
    client: Any,
    recipe: Recipe,
    add: Callable[[Task, Row], None],
    should_stop: Callable[[], bool],
) -> bool:
    """Whether all came to an end; `add` hears of each."""
    common = {"pure": False, "retries": RETRIES}
    pictures, rows = {}, {}
    for task in tasks:
        at = (task.scenario, task.scene)
        if at not in pictures:
            pictures[at] = client.submit(true_pictures, recipe, task, **common)
        rows[task] = client.submit(measure, recipe, task, pictures[at], **common)
    waiting = {at: sum((t.scenario, t.scene) == at for t in tasks) for at in pictures}
    for task, outcome in as_they_come(client, rows, should_stop):
        at = (task.scenario, task.scene)
        waiting[at] -= 1
        if not waiting[at]:
            del pictures[at]  # lets the workers forget them
        row = outcome.result if outcome.error is None else failed_row(task, recipe.size, _reason(outcome.error))
        del rows[task]
        add(task, row)
    finished = not rows
    client.cancel([*rows.values(), *pictures.values()])
    return finished


def _reason(error: BaseException) -> BaseException:
    if type(error).__name__ == "KilledWorker":
        return RuntimeError(_ALL_DIED)
    return error
