# SPDX-License-Identifier: Apache-2.0
"""Bounded fits from several starts of one problem: the best end, and other basins that cost little more."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ...solve.bounded_least_squares import Solution
from ...types.parameter import ParameterTable, Vector
from ..plans import RecordedPlan
from ..tolerances import ANOTHER_BASIN

# of a start, at most so many evaluations, and the cost of the best solution so far, which it has to be better than
Solve = Callable[[Vector, int, float], Solution]

_LONGER = 40  # evaluations of those that their trial has not finished


def race(
    solve: Solve,
    starts: Sequence[Vector],
    table: ParameterTable,
    plan: RecordedPlan,
    should_stop: Callable[[], bool],
) -> list[Solution]:
    """The best solution, then the others that differ from it and from each other and cost little more.

    Starts that fall behind are given up, and all others once one has solved the problem.
    """
    found: list[Solution] = []
    for start in starts:
        best = min((solution.equations.cost for solution in found), default=0.0)
        found.append(solve(start, plan.trial_evaluations, best))
        if _within(found[-1], plan.solved_rms) or should_stop():
            break
    found.sort(key=lambda solution: solution.equations.cost)
    leader = found[0]
    for place, candidate in enumerate(list(found)):
        near = _within(leader, plan.seen_rms)
        behind = candidate.equations.cost > (1.0 if near else plan.keep_factor) * leader.equations.cost
        if candidate.converged or behind or _within(leader, plan.solved_rms) or should_stop():
            continue
        longer = solve(candidate.x, _LONGER, 0.0 if candidate is leader else leader.equations.cost)
        found[place] = longer
        if longer.equations.cost < leader.equations.cost:
            leader = longer
    alone = _within(leader, plan.solved_rms)
    others = [] if alone else sorted(found, key=lambda solution: solution.equations.cost)
    return _different([leader, *others], table, plan)


def _different(solutions: Sequence[Solution], table: ParameterTable, plan: RecordedPlan) -> list[Solution]:
    chosen = [solutions[0]]
    for solution in solutions[1:]:
        near = solution.equations.cost <= plan.basin_factor * chosen[0].equations.cost
        if near and is_new(solution.x, [other.x for other in chosen], table):
            chosen.append(solution)
    return chosen[: plan.basins]


def different(points: Sequence[Vector], table: ParameterTable, count: int) -> list[Vector]:
    """The first `count` of the points that are each in another basin than those before."""
    chosen: list[Vector] = []
    for x in points:
        if len(chosen) < count and is_new(x, chosen, table):
            chosen.append(x)
    return chosen


def is_new(x: Vector, others: Iterable[Vector], table: ParameterTable) -> bool:
    """Whether a vector is in another basin than all others."""
    return all(table.apart(x, other) > ANOTHER_BASIN for other in others)


def _within(solution: Solution, rms: float) -> bool:
    return bool(np.sqrt(2.0 * solution.equations.cost) < rms)
