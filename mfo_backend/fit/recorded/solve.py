# SPDX-License-Identifier: Apache-2.0
"""Bounded solves of problems on recorded paths, with the limits that a recorded fit has for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...solve.bounded_least_squares import NormalEquations, Solution, SolveLimits, solve_bounded
from ..alike.unneeded_lobes import Box
from ..result.course import Stage
from ..squares.problem import Problem
from ..tolerances import CLEARLY_LOWER, SIGNIFICANT
from .recording import Setting, Vector

COST_CHANGE = 1e-5  # relative, of a step that ends a solve
# The same where there is noise, as a part of what one value explains of pure noise (chi squared)
NOT_SEEN = 0.3
COST_FLOOR = 1e-11  # a relative error of 5e-6 a pixel: below it float32 leaves nothing to gain
FEW_EVALUATIONS = 8


def solve(
    setting: Setting,
    problem: Problem,
    start: Vector,
    evaluations: int,
    *,
    stage: Stage | None = None,
    box: Box | None = None,
    known: float = 0.0,
    wanted: float | None = None,
) -> Solution:
    """A bounded solve whose evaluations are noted in `stage`; any other solution is better than one not finite.

    With the cost of a `known` solution it ends where it is nearly as good and promises nothing clearly better; with a
    `wanted` cost, where it promises no less than that.
    """
    plan, course = setting.plan, setting.course
    below, wanted = (plan.basin_factor * known, CLEARLY_LOWER * known) if wanted is None else (np.inf, wanted)
    limits = replace(_limits(setting, problem, evaluations), known=below, wanted=wanted)
    lower, upper = box or (setting.table.lower, setting.table.upper)
    equations = problem.equations if stage is None else course.watch(stage, problem.equations)
    try:
        return solve_bounded(equations, start, lower, upper, limits, course.should_stop)
    except ValueError:
        nothing = np.zeros(len(start))
        return Solution(start, NormalEquations(np.inf, nothing, np.diag(nothing)), (np.inf,), True)


def solve_within(setting: Setting, problem: Problem, start: Vector, box: Box, *, wanted: float = np.inf) -> Vector:
    """A few steps with other bounds from another solution, given up where they promise no less than `wanted`."""
    return solve(setting, problem, start, FEW_EVALUATIONS, box=box, wanted=wanted).x


def better_basin(setting: Setting, problem: Problem, found: Vector, others: Sequence[Vector]) -> Vector | None:
    """The best of the other basins on the same problem, if it is clearly better than `found`.

    Of few residuals a small part is chance: among materials that are `alike` one has to have a chi squared that noise
    does not explain.
    """
    if not others or setting.course.should_stop():
        return None
    evaluations = setting.plan.trial_evaluations
    # a solve that ended for want of evaluations has more to gain than its quadratic says
    known = solve(setting, problem, found, evaluations).equations.cost
    rivals = (solve(setting, problem, x, evaluations, known=known) for x in others)
    best = min(rivals, key=lambda rival: rival.equations.cost)
    lower = min(CLEARLY_LOWER, 1.0 - SIGNIFICANT / problem.independent) if setting.plan.alike else CLEARLY_LOWER
    return best.x if best.equations.cost < lower * known else None


def _limits(setting: Setting, problem: Problem, evaluations: int) -> SolveLimits:
    """Limits of a solve, which ends where there is noise at the change that it explains by itself."""
    noise = NOT_SEEN / problem.independent if setting.sampled else 0.0
    unseen = 0.0 if problem.near is None else noise  # the search for a start has few and large tiles
    change = max(COST_CHANGE, noise)
    return SolveLimits(evaluations=evaluations, cost_change=change, cost_floor=COST_FLOOR, unseen=unseen)
