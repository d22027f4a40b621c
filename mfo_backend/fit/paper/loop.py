# SPDX-License-Identifier: Apache-2.0
"""The paper's course of a fit: every stage is a new optimisation from the best values of the one before."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...metrics.loss import Loss
from ...render.renderer import Renderer
from ...solve.adam import Adam
from ...types.event import Listener, Preview, Progress, StageEnd
from ...types.image import Pixels
from ...types.result import CurvePoint, StageReport
from ...types.status import Status
from ..result.best_so_far import BestSoFar
from ..result.outcome import Candidate
from ..settings import FitSettings
from .adam_stage import SCHEDULES, StageOutcome, Step, run_stage

_PREVIEW_SECONDS = 1.0  # no more than one preview in this time


@dataclass(frozen=True)
class StagesOutcome:
    """Start and best of every stage in order, under the fit's own seed, and how the last stage that ran ended."""

    status: Status
    candidates: tuple[Candidate, ...]
    reports: tuple[StageReport, ...]


def run_stages(
    renderer: Renderer,
    losses: Sequence[Loss],
    start: Candidate,
    settings: FitSettings,
    *,
    listener: Listener,
    should_stop: Callable[[], bool],
    clock: Callable[[], float] = time.monotonic,
    began: float | None = None,
) -> StagesOutcome:
    """Minimise the losses one after another; `began` is the time on `clock` at which the fit began."""
    began = clock() if began is None else began
    candidates, reports, status = [start], [], Status.CONVERGED
    adam = _new_adam(renderer, settings)
    best = BestSoFar(renderer, listener, began)
    for index, loss in enumerate(losses):
        if not settings.keep_optimizer_state:
            adam = _new_adam(renderer, settings)
        log = _StageLog(renderer, loss.name, index, len(losses), listener, clock, began, best)
        outcome = run_stage(
            renderer,
            loss.value_and_gradient,
            candidates[-1].vector,
            adam,
            rules=settings.rules,
            schedule=SCHEDULES[settings.schedule],
            seed=settings.seed,
            spp=settings.spp,
            on_step=log,
            should_stop=should_stop,
        )
        status = outcome.status
        candidates.append(_candidate(outcome, candidates[-1]))
        reports.append(log.report(outcome))
        if status in (Status.CANCELLED, Status.FAILED):
            break
    return StagesOutcome(status, tuple(candidates), tuple(reports))


class _StageLog:
    """Turns the steps of one stage into events and its report."""

    def __init__(
        self,
        renderer: Renderer,
        name: str,
        index: int,
        count: int,
        listener: Listener,
        clock: Callable[[], float],
        began: float,
        best: BestSoFar,
    ) -> None:
        self._renderer, self._name, self._index, self._count = renderer, name, index, count
        self._listener, self._clock, self._began, self._best = listener, clock, began, best
        self._entered = clock()
        self._previewed = -np.inf
        self._unseen: Pixels | None = None
        self._fraction = 0.0
        self._curve: list[CurvePoint] = []

    def __call__(self, step: Step) -> None:
        now = self._clock()
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
        if self._unseen is not None and now - self._previewed >= _PREVIEW_SECONDS:
            self._previewed = now
            self._listener(Preview(self._unseen))
            self._unseen = None

    def report(self, outcome: StageOutcome) -> StageReport:
        status = outcome.status
        self._best.tell(self._clock(), at_once=True)
        self._listener(
            StageEnd(
                stage=self._name,
                status=status.value,
                sentence=status.sentence,
                iterations=outcome.iterations,
                loss_start=outcome.loss_start,
                loss_best=outcome.loss_best,
            )
        )
        return StageReport(
            name=self._name,
            status=status,
            loss_start=outcome.loss_start,
            loss_best=outcome.loss_best,
            iterations=outcome.iterations,
            seconds=self._clock() - self._entered,
            values=self._renderer.table.unpack(outcome.vector),
            curve=tuple(self._curve),
        )


def _new_adam(renderer: Renderer, settings: FitSettings) -> Adam:
    lower, upper = renderer.table.lower, renderer.table.upper
    return Adam(lower, upper, settings.learning_rate * (upper - lower))


def _candidate(outcome: StageOutcome, before: Candidate) -> Candidate:
    return before if outcome.image is None else Candidate(outcome.vector, outcome.image)
