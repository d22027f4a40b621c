# SPDX-License-Identifier: Apache-2.0
"""The course of a second-order fit: least-squares stages turned into events and reports."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from ...render.pictures.renderer import Renderer
from ...solve.bounded_least_squares import NormalEquations
from ...types.event import Listener, Preview, Progress, StageEnd
from ...types.image import Pixels
from ...types.parameter import Vector
from ...types.result import CurvePoint, StageReport
from ...types.status import Status
from .best_so_far import ONCE_SECONDS, BestSoFar

_QUIET_SECONDS = 0.05  # between two progress events; an iteration takes about a millisecond

# What the stages take of the time of a fit, and how many evaluations they need: rough means for the time left
_EXPECTED = {
    "scan": (2.0, 90),
    "start": (3.0, 80),
    "refine": (3.0, 20),
    "display": (1.0, 10),
    "itp": (1.0, 10),
    "flip": (4.0, 20),
    "race": (2.0, 5),
    "polish": (4.0, 10),
}
_VERIFICATION = 1.5  # the pictures after the last stage, in the same unit


@dataclass
class Stage:
    """What a running stage has seen: the root mean square of its residual at every evaluation."""

    name: str
    curve: list[CurvePoint] = field(default_factory=list)
    status: Status = Status.CONVERGED
    vector: Vector | None = None
    loss_start: float = np.nan
    loss_best: float = np.inf
    best: Vector | None = None  # of the lowest loss, until it has been shown
    picture: Callable[[Vector], Pixels] | None = field(default=None, repr=False)  # of a vector, for previews


class Course:
    """Runs the named stages one after another and tells the listener.

    `picture` makes the previews of stages that have none of their own.
    """

    def __init__(
        self,
        renderer: Renderer,
        stages: tuple[str, ...],
        listener: Listener,
        should_stop: Callable[[], bool],
        began: float,
        picture: Callable[[Vector], Pixels] | None = None,
    ) -> None:
        self.names = stages
        self.should_stop = should_stop
        self.reports: list[StageReport] = []
        self._renderer, self._listener, self._began = renderer, listener, began
        self._told, self._shown = -np.inf, began
        self._best = BestSoFar(renderer, listener, began)
        self._picture = picture

    @contextmanager
    def stage(self, name: str) -> Iterator[Stage]:
        """Open a stage; its end event and report follow when the block is left."""
        entered = time.monotonic()
        stage = Stage(name, picture=self._picture)
        yield stage
        if self.should_stop():
            stage.status = Status.CANCELLED
        if stage.vector is not None:
            self._best.found(name, stage.vector)
        self._best.tell(at_once=True)
        vector = self._renderer.start if stage.vector is None else stage.vector
        best = float(min(stage.loss_best, stage.loss_start))
        self._listener(
            StageEnd(name, stage.status.value, stage.status.sentence, len(stage.curve), stage.loss_start, best)
        )
        self.reports.append(
            StageReport(
                name=name,
                status=stage.status,
                loss_start=stage.loss_start,
                loss_best=best,
                iterations=len(stage.curve),
                seconds=time.monotonic() - entered,
                values=self._renderer.table.unpack(vector),
                curve=tuple(stage.curve),
            )
        )

    def watch(
        self, stage: Stage, residuals: Callable[[Vector], NormalEquations]
    ) -> Callable[[Vector], NormalEquations]:
        """`residuals`, with every evaluation noted in `stage`."""

        def watched(x: Vector) -> NormalEquations:
            equations = residuals(x)
            self.note(stage, x, float(np.sqrt(2.0 * equations.cost)) if equations.finite else np.inf)
            return equations

        return watched

    def show(self, stage: Stage, x: Vector) -> None:
        """Tell a preview of `x`, the best so far, however long ago the last one was."""
        if stage.picture is None:
            return
        with self._renderer.counter.uncounted():  # how many previews there are depends on the clock
            self._listener(Preview(stage.picture(x)))
        stage.best, self._shown = None, time.monotonic()

    def note(self, stage: Stage, x: Vector, loss: float, *, best: bool = False) -> None:
        """Add an evaluation with this root mean square to `stage` and tell the listener, if it has not just heard.

        `best` is the best so far whatever its loss, which noise may have a part in.
        """
        if best or loss < stage.loss_best:
            stage.best = x.copy()
            self._best.found(stage.name, x)
        if not stage.curve:
            stage.loss_start = loss
        stage.loss_best = min(stage.loss_best, loss)
        now = time.monotonic()
        seconds = now - self._began
        stage.curve.append(CurvePoint(len(stage.curve) + 1, loss, stage.loss_best, seconds, self._renderer.passes))
        self._best.tell(now)
        if now - self._told > _QUIET_SECONDS:
            self._told = now
            self._tell(stage, loss, seconds)
        if stage.best is not None and time.monotonic() - self._shown >= ONCE_SECONDS:
            self.show(stage, stage.best)

    def _tell(self, stage: Stage, loss: float, seconds: float) -> None:
        index = self.names.index(stage.name)
        shares = [_EXPECTED.get(name, (1.0, 10))[0] for name in self.names]
        count = len(stage.curve)
        within = count / (count + _EXPECTED.get(stage.name, (1.0, 10))[1])
        fraction = (sum(shares[:index]) + shares[index] * within) / (sum(shares) + _VERIFICATION)
        self._listener(
            Progress(
                stage=stage.name,
                stage_index=index,
                stage_count=len(self.names),
                iteration=count,
                loss=loss,
                best=stage.loss_best,
                fraction=fraction,
                seconds=seconds,
                remaining_seconds=seconds * (1.0 - fraction) / fraction,
            )
        )
