# SPDX-License-Identifier: Apache-2.0
"""What a stage of the paper's loop tells: events while it runs, and its report."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...render.pictures.renderer import Renderer
from ...types.event import Listener, Preview, Progress, StageEnd
from ...types.image import Pixels
from ...types.result import CurvePoint, StageReport
from ...types.status import Status
from ..result.best_so_far import ONCE_SECONDS, BestSoFar


@dataclass(frozen=True)
class Step:
    """One evaluated iterate; `more` is how many iterations the stage is thought to need yet."""

    iteration: int
    loss: float
    best: float
    more: float
    improved: bool
    vector: NDArray[np.float64]
    image: Pixels = field(repr=False)


class StageLog:
    """Turns the steps of one stage into events and its report."""

    def __init__(
        self,
        renderer: Renderer,
        name: str,
        index: int,
        count: int,
        listener: Listener,
        began: float,
        best: BestSoFar,
    ) -> None:
        self._renderer, self._name, self._index, self._count = renderer, name, index, count
        self._listener, self._began, self._best = listener, began, best
        self._entered = time.monotonic()
        self._previewed = -np.inf
        self._unseen: Pixels | None = None
        self._fraction = 0.0
        self._curve: list[CurvePoint] = []

    def __call__(self, step: Step) -> None:
        """Tell what one evaluated iterate says."""
        now = time.monotonic()
        done = step.iteration / (step.iteration + step.more)
        self._fraction = max(self._fraction, (self._index + done) / self._count)
        in_stage = now - self._entered
        stage_total = in_stage * (step.iteration + step.more) / step.iteration
        # later stages are thought to take as long as this one; nothing better is known before they run
        remaining = stage_total - in_stage + stage_total * (self._count - 1 - self._index)
        seconds = now - self._began
        self._curve.append(CurvePoint(step.iteration, step.loss, step.best, seconds, self._renderer.passes))
        self._listener(
            Progress(
                stage=self._name,
                stage_index=self._index,
                stage_count=self._count,
                iteration=step.iteration,
                loss=step.loss,
                best=step.best,
                fraction=self._fraction,
                seconds=seconds,
                remaining_seconds=remaining,
            )
        )
        if step.improved:
            self._unseen = step.image
            self._best.found(self._name, step.vector)
        self._best.tell(now)
        if self._unseen is not None and now - self._previewed >= ONCE_SECONDS:
            self._previewed = now
            self._listener(Preview(self._unseen))
            self._unseen = None

    def report(self, status: Status, vector: NDArray[np.float64]) -> StageReport:
        """Tell the stage's end; `vector` holds its best values."""
        iterations = len(self._curve)
        loss_start, loss_best = (self._curve[0].loss, self._curve[-1].best) if self._curve else (np.nan, np.inf)
        self._best.tell(time.monotonic(), at_once=True)
        self._listener(StageEnd(self._name, status.value, status.sentence, iterations, loss_start, loss_best))
        return StageReport(
            name=self._name,
            status=status,
            loss_start=loss_start,
            loss_best=loss_best,
            iterations=iterations,
            seconds=time.monotonic() - self._entered,
            values=self._renderer.table.unpack(vector),
            curve=tuple(self._curve),
        )
