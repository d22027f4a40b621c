# SPDX-License-Identifier: Apache-2.0
"""The loop of "Multi-Fidelity Optimization for Inverse Material Rendering", as it is in the paper.

Given are one reference R, and a renderer that makes a picture I(x) of the material x with its derivatives.

1. LF: from the user's x, minimise a low-fidelity loss L(I(x), R), the mean square error, until its stopping rule fires.
2. HF: from the best x of that, begin a *new* optimisation on a high-fidelity loss, FLIP: the optimiser's moments and
   its rate are those of a beginning (`FitSettings.keep_optimizer_state` keeps them, which the paper tried, too).

A stage stops when for ten iterations its loss does not change, when for ten iterations its best loss does not improve,
or at the user's maximum of iterations (`solve.stopping`). The paper leaves the optimiser open; this one is Adam
(`solve.adam`), and `LEVELS` says what becomes of its rate. Any list of losses makes as many stages.

With a fixed seed every I(x) of a fit sees the same random numbers, so the losses of two iterates differ by x alone.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...metrics.losses.loss import Loss
from ...render.pictures.renderer import Interrupted, Renderer, Vector
from ...solve.adam import Adam
from ...solve.stopping import Stopping, StoppingRules
from ...types.event import Listener
from ...types.image import Pixels
from ...types.result import StageReport
from ...types.status import Status
from ..result.best_so_far import BestSoFar
from ..result.outcome import Candidate
from ..settings import FitSettings
from .stage_log import StageLog, Step

_STRIKES = 3  # steps in a row without a finite loss and gradient after which a stage gives up


# Rates that a stage goes through, each so much of the one before.
# With a constant rate near a minimum Adam walks in steps of about that rate. The best loss stops improving, and the
# rule of ten iterations ends the stage wherever it happens to be; under FLIP that is often at its very start. With
# more rates each such stall is answered by going back to the best x with the next one and new moments. The stage ends
# by the same rule at the last rate.
LEVELS, FALL = {"constant": 1, "decay": 4}, 1.0 / 3.0


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
    began: float | None = None,
) -> StagesOutcome:
    """The stages: minimise the losses one after another, each from the best x of the one before.

    `began` is the fit's begin on the monotonic clock, now where it is not given.
    """
    began = time.monotonic() if began is None else began
    candidates, reports, status = [start], [], Status.CONVERGED
    adam = _new_adam(renderer, settings)
    best = BestSoFar(renderer, listener, began)
    for index, loss in enumerate(losses):
        if not settings.keep_optimizer_state:
            adam = _new_adam(renderer, settings)
        log = StageLog(renderer, loss.name, index, len(losses), listener, began, best)
        status, found = run_stage(
            renderer,
            loss.value_and_gradient,
            candidates[-1].vector,
            adam,
            rules=settings.rules,
            levels=LEVELS[settings.schedule],
            seed=settings.seed,
            spp=settings.spp,
            on_step=log,
            should_stop=should_stop,
        )
        candidates.append(found or candidates[-1])
        reports.append(log.report(status, candidates[-1].vector))
        if status in (Status.CANCELLED, Status.FAILED):
            break
    return StagesOutcome(status, tuple(candidates), tuple(reports))


def _new_adam(renderer: Renderer, settings: FitSettings) -> Adam:
    lower, upper = renderer.table.lower, renderer.table.upper
    return Adam(lower, upper, settings.learning_rate * (upper - lower))


def run_stage(
    renderer: Renderer,
    value_and_gradient: Callable[[Pixels], tuple[float, Pixels]],
    start: Vector,
    adam: Adam,
    *,
    rules: StoppingRules,
    levels: int,
    seed: int,
    spp: int,
    on_step: Callable[[Step], None],
    should_stop: Callable[[], bool],
) -> tuple[Status, Candidate | None]:
    """One stage: x <- Adam(x, dL/dx), dL/dx = (dI/dx)^T dL/dI, until a stopping rule fires; how it ended, and its best.

    The rate of `adam` is the first of `levels` rates. A step that leads to a loss or gradient that is not finite
    is taken back half way to the best iterate; three in a row end the stage. None is best where no loss was finite.
    """
    stopping = Stopping(rules)
    first_rate, level, strikes = adam.rate, 0, 0
    x, best_loss = start, math.inf
    best: Candidate | None = None
    status = None
    while status is None:
        if should_stop():
            status = Status.CANCELLED
            break
        try:
            image, pullback = renderer.image_and_pullback(x, seed=seed, spp=spp)
        except Interrupted:
            status = Status.CANCELLED
            break
        loss, pixel_gradient = value_and_gradient(image)
        improved = loss < best_loss
        if improved:
            best, best_loss = Candidate(x, image), loss
        status = stopping.observe(loss)
        more = _expected_iterations(stopping, levels - 1 - level)
        more = more if status is None else 0.0
        on_step(Step(stopping.iterations, loss, best_loss, more, improved, x, image))

        may_go_on = level + 1 < levels and stopping.iterations < rules.max_iterations
        if status is Status.STALE and may_go_on:
            level += 1
            adam.rate = first_rate * FALL**level
            adam.reset()
            stopping.resume()
            x, status = start if best is None else best.vector, None
            continue
        if status is not None:
            break
        try:
            gradient = pullback(pixel_gradient) if math.isfinite(loss) else np.full_like(x, math.nan)
        except Interrupted:
            status = Status.CANCELLED
            break
        if np.isfinite(gradient).all():
            strikes = 0
            x = adam.step(x, gradient)
            continue
        strikes += 1
        adam.reset()
        if strikes >= _STRIKES or best is None:
            status = Status.FAILED
        else:
            x = 0.5 * (x + best.vector)
    return status, best


def _expected_iterations(stopping: Stopping, levels_left: int) -> float:
    """A guess for the remaining time only: half as many again as so far, and two patiences for each level to come."""
    patience = stopping.rules.patience
    guess = 0.5 * stopping.iterations + max(patience - stopping.stalled, 0) + 2.0 * patience * levels_left
    return min(guess, stopping.rules.max_iterations - stopping.iterations)
