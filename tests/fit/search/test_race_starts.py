# SPDX-License-Identifier: Apache-2.0
"""Of several starts, the best solution and other basins are kept, and no evaluation goes into what is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.search.race_starts import race
from mfo_backend.fit.tolerances import CLEARLY_LOWER
from mfo_backend.solve.bounded_least_squares import TRIED, NormalEquations, SolveLimits, solve_bounded
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable([Parameter("x", 1, -3.0, 3.0, 0.0)])
PLAN = RecordedPlan()
NOISE = 0.5  # a cost that no value lowers


@dataclass
class Valleys:
    """Residuals x^2 - 1, (x - 1) / 10 and what is noise: the bottom is at 1, and there is a worse valley near -1."""

    noise: float
    evaluations: int = 0

    def __call__(self, x):
        self.evaluations += 1
        residual = np.array([x[0] ** 2 - 1.0, 0.1 * (x[0] - 1.0)])
        jacobian = np.array([[2.0 * x[0]], [0.1]])
        cost = 0.5 * float(residual @ residual) + self.noise
        return NormalEquations(cost, jacobian.T @ residual, jacobian.T @ jacobian)

    def solve(self, start, evaluations, known):
        limits = SolveLimits(evaluations, cost_change=1e-9, known=PLAN.basin_factor * known)
        return solve_bounded(self, start, TABLE.lower, TABLE.upper, replace(limits, wanted=CLEARLY_LOWER * known))

    def race(self, *starts, plan=PLAN):
        starts = [np.array([x]) for x in starts]
        return race(self.solve, starts, TABLE, plan, lambda: False)


@pytest.mark.parametrize("starts", [(0.4, -0.5), (-0.5, 0.4), (-0.5, -2.0, 0.4, 2.5)], ids=str)
def test_the_best_valley_comes_first_and_the_other_is_kept(starts):
    best, *others = Valleys(NOISE).race(*starts)
    assert best.x[0] == pytest.approx(1.0, abs=1e-2)
    (other,) = others
    assert other.x[0] == pytest.approx(-1.0, abs=0.1)


def test_a_valley_that_costs_too_much_is_not_kept():
    (best,) = Valleys(1e-4).race(0.4, -0.5)
    assert best.x[0] == pytest.approx(1.0, abs=1e-2)


def test_what_promises_nothing_better_takes_few_evaluations():
    starts = (2.9, 2.7, 2.5, 2.3)
    alone, together = [Valleys(NOISE) for _ in starts], Valleys(NOISE)
    for valleys, start in zip(alone, starts, strict=True):
        valleys.race(start)
    together.race(*starts)
    assert min(valleys.evaluations for valleys in alone) > TRIED
    assert together.evaluations == alone[0].evaluations + 3 * TRIED


def test_a_start_that_solves_it_ends_the_race():
    first, both = Valleys(0.0), Valleys(0.0)
    (best,) = first.race(0.4)
    assert np.sqrt(2 * best.equations.cost) < PLAN.solved_rms
    both.race(0.4, -0.5)
    assert both.evaluations == first.evaluations


@pytest.mark.parametrize(("share", "ends"), [(0.9, True), (1.1, False)])
def test_the_race_ends_below_the_root_mean_square_of_a_solved_problem(share, ends):
    first, both = (Valleys(0.5 * (share * PLAN.solved_rms) ** 2) for _ in range(2))
    first.race(0.4)
    both.race(0.4, -0.5)
    assert (both.evaluations == first.evaluations) is ends


def test_an_unfinished_trial_goes_on():
    hurried = replace(PLAN, trial_evaluations=2)
    (best,) = Valleys(1e-4).race(2.9, plan=hurried)
    assert best.converged
    assert best.x[0] == pytest.approx(1.0, abs=1e-2)
