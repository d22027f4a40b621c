# SPDX-License-Identifier: Apache-2.0
"""One stage: Adam on one loss, from given values, until a stopping rule fires."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...render.renderer import Interrupted, Renderer
from ...solve.adam import Adam
from ...solve.stopping import Stopping, StoppingRules
from ...types.image import Pixels
from ...types.status import Status

_STRIKES = 3  # steps in a row without a finite loss and gradient after which a stage gives up


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


@dataclass(frozen=True)
class StageOutcome:
    """How a stage ended and the best iterate with its picture; `vector` is the start where nothing was better."""

    status: Status
    vector: NDArray[np.float64]
    image: Pixels | None
    loss_start: float
    loss_best: float
    iterations: int


def run_stage(
    renderer: Renderer,
    value_and_gradient: Callable[[Pixels], tuple[float, Pixels]],
    start: NDArray[np.float64],
    adam: Adam,
    *,
    rules: StoppingRules,
    schedule: Schedule,
    seed: int,
    spp: int,
    on_step: Callable[[Step], None],
    should_stop: Callable[[], bool],
) -> StageOutcome:
    """Minimise a loss of the picture over the box of `adam`, whose rate is that of the schedule's first level.

    A step that leads to a loss or gradient that is not finite is taken back half way to the best iterate; three in a
    row end the stage.
    """
    stopping = Stopping(rules)
    first_rate, level, strikes = adam.rate, 0, 0
    vector, best = start, start
    best_loss, best_image, loss_start = math.inf, None, math.nan
    status = None
    while status is None:
        if should_stop():
            status = Status.CANCELLED
            break
        try:
            image, pullback = renderer.image_and_pullback(vector, seed=seed, spp=spp)
        except Interrupted:
            status = Status.CANCELLED
            break
        loss, pixel_gradient = value_and_gradient(image)
        if stopping.iterations == 0:
            loss_start = loss
        improved = loss < best_loss
        if improved:
            best, best_loss, best_image = vector, loss, image
        status = stopping.observe(loss)
        more = _expected_iterations(stopping, schedule.levels - 1 - level)
        more = more if status is None else 0.0
        on_step(Step(stopping.iterations, loss, best_loss, more, improved, vector, image))

        may_go_on = level + 1 < schedule.levels and stopping.iterations < rules.max_iterations
        if status is Status.STALE and may_go_on:
            level += 1
            adam.rate = schedule.rate(first_rate, level)
            adam.reset()
            stopping.resume()
            vector, status = best, None
            continue
        if status is not None:
            break
        try:
            gradient = pullback(pixel_gradient) if math.isfinite(loss) else np.full_like(vector, math.nan)
        except Interrupted:
            status = Status.CANCELLED
            break
        if np.isfinite(gradient).all():
            strikes = 0
            vector = adam.step(vector, gradient)
            continue
        strikes += 1
        adam.reset()
        vector = 0.5 * (vector + best)
        if strikes >= _STRIKES or best_image is None:
            status = Status.FAILED
    return StageOutcome(status, best, best_image, loss_start, best_loss, stopping.iterations)


def _expected_iterations(stopping: Stopping, levels_left: int) -> float:
    """A guess for the remaining time only: half as many again as so far, and two patiences for each level to come."""
    patience = stopping.rules.patience
    guess = 0.5 * stopping.iterations + max(patience - stopping.stalled, 0) + 2.0 * patience * levels_left
    return min(guess, stopping.rules.max_iterations - stopping.iterations)


@dataclass(frozen=True)
class Schedule:
    """Rates a stage goes through: `levels` of them, each `factor` of the one before."""

    levels: int = 1
    factor: float = 1.0 / 3.0

    def rate(self, first: NDArray[np.float64], level: int) -> NDArray[np.float64]:
        """The rate at `level`, counted from 0."""
        return first * self.factor**level


SCHEDULES = {"constant": Schedule(levels=1), "decay": Schedule(levels=4)}
