# SPDX-License-Identifier: Apache-2.0
"""The course of a second-order fit: least-squares stages turned into events and reports."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..render.renderer import Renderer
from ..solve.bounded_least_squares import NormalEquations
from ..types.event import Listener, Progress, StageEnd
from ..types.result import CurvePoint, StageReport
from ..types.status import Status

Vector = NDArray[np.float64]
_QUIET_SECONDS = 0.05  # between two progress events; an iteration takes about a millisecond


@dataclass
class Stage:
    """What a running stage has seen: the root mean square of its residual at every evaluation."""

    name: str
    curve: list[CurvePoint] = field(default_factory=list)
    status: Status = Status.CONVERGED
    vector: Vector | None = None
    loss_start: float = np.nan
    loss_best: float = np.inf


class Course:
    """Runs the named stages one after another and tells the listener."""

    def __init__(
        self,
        renderer: Renderer,
        stages: tuple[str, ...],
        listener: Listener,
        should_stop: Callable[[], bool],
        began: float,
    ) -> None:
        self.names = stages
        self.should_stop = should_stop
        self.reports: list[StageReport] = []
        self._renderer, self._listener, self._began = renderer, listener, began
        self._told = -np.inf

    @contextmanager
    def stage(self, name: str) -> Iterator[Stage]:
        """Open a stage; its end event and report follow when the block is left."""
        entered = time.monotonic()
        stage = Stage(name)
        yield stage
        if self.should_stop():
            stage.status = Status.CANCELLED
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
            self.note(stage, float(np.sqrt(2.0 * equations.cost)) if equations.finite else np.inf)
            return equations

        return watched

    def note(self, stage: Stage, loss: float) -> None:
        """Add an evaluation with this root mean square to `stage` and tell the listener, if it has not just heard."""
        if not stage.curve:
            stage.loss_start = loss
        stage.loss_best = min(stage.loss_best, loss)
        now = time.monotonic()
        seconds = now - self._began
        stage.curve.append(CurvePoint(len(stage.curve) + 1, loss, stage.loss_best, seconds, self._renderer.passes))
        if now - self._told > _QUIET_SECONDS:
            self._told = now
            self._tell(stage, loss, seconds)

    def _tell(self, stage: Stage, loss: float, seconds: float) -> None:
        index = self.names.index(stage.name)
        # the stages have no known length: half of the running one is a fair guess
        fraction = (index + 0.5) / len(self.names)
        self._listener(
            Progress(
                stage=stage.name,
                stage_index=index,
                stage_count=len(self.names),
                iteration=len(stage.curve),
                loss=loss,
                best=stage.loss_best,
                fraction=fraction,
                seconds=seconds,
                remaining_seconds=seconds * (1.0 - fraction) / fraction,
            )
        )
