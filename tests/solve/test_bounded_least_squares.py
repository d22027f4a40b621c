# SPDX-License-Identifier: Apache-2.0
"""Oracle: `scipy.optimize.least_squares` (trf), and problems with known solutions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from mfo_backend.solve.bounded_least_squares import (
    FALSE_PROMISE,
    TRIED,
    NormalEquations,
    SolveLimits,
    solve_bounded,
    step_in_box,
)

T = np.linspace(0, 4, 40)
DATA = 0.8 * np.exp(-1.3 * T) + 0.4 * np.cos(1.7 * T)


def curve(x: np.ndarray) -> np.ndarray:
    return x[0] * np.exp(-x[1] * T) + x[2] * np.cos(x[3] * T) - DATA


def curve_jacobian(x: np.ndarray) -> np.ndarray:
    decay = np.exp(-x[1] * T)
    return np.stack([decay, -x[0] * T * decay, np.cos(x[3] * T), -x[2] * T * np.sin(x[3] * T)], axis=1)


def equations(x: np.ndarray) -> NormalEquations:
    r, j = curve(x), curve_jacobian(x)
    return NormalEquations(0.5 * float(r @ r), j.T @ r, j.T @ j)


LOWER = np.zeros(4)


@pytest.mark.parametrize("upper", [3.0, 1.0])  # with 1.0 the solution lies on two bounds
@pytest.mark.parametrize("seed", range(5))
def test_ends_no_higher_than_trf(seed, upper):
    start = np.array([0.5, 1.0, 0.5, 1.5]) * np.random.default_rng(seed).uniform(0.8, 1.2, 4)
    start = np.minimum(start, 0.99 * upper)
    box = np.full(4, upper)
    reference = least_squares(curve, start, curve_jacobian, (LOWER, box), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    limits = SolveLimits(evaluations=100, cost_change=1e-12, step=1e-10)
    solution = solve_bounded(equations, start, LOWER, box, limits)
    # trf stays strictly inside the box, so it can only approach a solution on a bound
    assert solution.equations.cost <= reference.cost * (1 + 1e-6) + 1e-20
    assert len(solution.costs) <= 3 * reference.nfev + 5


def test_a_solution_on_a_bound_is_exactly_on_it():
    solution = solve_bounded(equations, np.full(4, 0.5), LOWER, np.full(4, 1.0), SolveLimits(evaluations=100))
    assert solution.x[1] == 1.0


def test_a_linear_problem_needs_few_evaluations():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(30, 6)), rng.normal(size=30)
    limits = SolveLimits(damping=1e-8)
    solution = solve_bounded(
        lambda x: NormalEquations(0.5 * float(np.sum((a @ x - b) ** 2)), a.T @ (a @ x - b), a.T @ a),
        np.zeros(6), np.full(6, -9.0), np.full(6, 9.0), limits,
    )  # fmt: skip
    np.testing.assert_allclose(solution.x, np.linalg.lstsq(a, b, rcond=None)[0], atol=1e-6)
    assert len(solution.costs) <= 3
    assert solution.converged


def test_a_non_finite_trial_is_a_rejected_step():
    def with_hole(x: np.ndarray) -> NormalEquations:
        good = equations(x)
        return good if x[1] < 1.25 else NormalEquations(np.nan, good.gradient, good.hessian)

    start = np.array([0.5, 0.3, 0.5, 1.5])
    solution = solve_bounded(with_hole, start, LOWER, np.full(4, 3.0))
    assert np.inf in solution.costs
    assert solution.equations.finite
    assert solution.equations.cost < with_hole(start).cost


def test_never_ends_above_the_start_and_obeys_the_budget():
    start = np.array([0.8, 1.3, 0.4, 1.7])  # the solution itself
    solution = solve_bounded(
        equations, start, LOWER, np.full(4, 3.0), SolveLimits(evaluations=4, step=0.0, cost_change=0.0)
    )
    assert solution.equations.cost <= equations(start).cost
    assert len(solution.costs) <= 4


def test_a_column_without_effect_keeps_its_value():
    def flat(x: np.ndarray) -> NormalEquations:
        r = np.array([x[0] - 0.3, 2.0 * (x[0] - 0.3)])
        j = np.array([[1.0, 0.0], [2.0, 0.0]])
        return NormalEquations(0.5 * float(r @ r), j.T @ r, j.T @ j)

    solution = solve_bounded(flat, np.array([0.9, 0.7]), np.zeros(2), np.ones(2))
    np.testing.assert_allclose(solution.x, [0.3, 0.7], atol=1e-5)


def test_stops_when_asked():
    solution = solve_bounded(equations, np.full(4, 0.5), LOWER, np.full(4, 3.0), should_stop=lambda: True)
    assert len(solution.costs) == 1
    assert not solution.converged


def test_a_start_without_finite_residuals_is_refused():
    with pytest.raises(ValueError, match="not finite at the start"):
        solve_bounded(lambda x: NormalEquations(np.nan, x, np.eye(2)), np.zeros(2), -np.ones(2), np.ones(2))


def never_below(x: np.ndarray) -> NormalEquations:
    """The curve with a residual of 1 that nothing changes: no cost is below a half."""
    good = equations(x)
    return NormalEquations(good.cost + 0.5, good.gradient, good.hessian)


@pytest.mark.parametrize(
    ("known", "wanted", "ends_early"),
    [(np.inf, 0.49, True), (np.inf, 0.51, False), (0.4, 0.39, False), (0.0, 0.0, False)],
    ids=["promises nothing better", "may be better", "worse than the known", "none known"],
)
def test_a_solve_without_promise_ends(known, wanted, ends_early):
    start, box = np.array([0.3, 0.5, 0.9, 1.2]), np.full(4, 3.0)
    limits = SolveLimits(evaluations=100, cost_change=1e-12, step=1e-10)
    whole = solve_bounded(never_below, start, LOWER, box, limits)
    assert len(whole.costs) > TRIED + 1
    limits = SolveLimits(evaluations=100, cost_change=1e-12, step=1e-10, known=known, wanted=wanted)
    solution = solve_bounded(never_below, start, LOWER, box, limits)
    assert (len(solution.costs) == TRIED) == ends_early
    assert solution.converged
    assert ends_early or solution.equations.cost == whole.equations.cost


@pytest.mark.parametrize("unseen", [1e-2, 1e-4])
def test_a_solve_ends_where_noise_hides_what_is_left(unseen):
    start, box = np.array([0.3, 0.5, 0.9, 1.2]), np.full(4, 3.0)
    limits = SolveLimits(evaluations=100, cost_change=1e-12, step=1e-10)
    whole = solve_bounded(never_below, start, LOWER, box, limits)
    solution = solve_bounded(never_below, start, LOWER, box, replace(limits, unseen=unseen))
    assert solution.converged
    assert len(solution.costs) < len(whole.costs)
    # the quadratic is only about right, so what is left may be a little more than it says
    assert solution.equations.cost <= whole.equations.cost * (1.0 + 2.0 * unseen)


@pytest.mark.parametrize(("curvature", "ends"), [(1e-3, True), (1e-2, False)], ids=["level", "promising"])
def test_a_rejected_step_that_promised_little_is_the_last(curvature, ends):
    """A cost of 1 at x = 0 that is higher at every trial; the quadratic there promises half its curvature."""
    limits = SolveLimits(evaluations=6, cost_change=1e-9, unseen=1e-4)
    assert limits.unseen < 0.5 * curvature
    assert (0.5 * curvature < FALSE_PROMISE * limits.unseen) == ends

    def uphill(x: np.ndarray) -> NormalEquations:
        return NormalEquations(1.0 + float(x[0] != 0.0), np.array([-curvature]), np.array([[curvature]]))

    solution = solve_bounded(uphill, np.zeros(1), -np.ones(1), 2.0 * np.ones(1), limits)
    assert solution.x[0] == 0.0
    assert (len(solution.costs) == 2) == ends


@pytest.mark.parametrize("seed", range(4))
def test_the_quadratic_promises_the_least_cost_in_the_box(seed):
    rng = np.random.default_rng(seed)
    a, b, x = rng.normal(size=(30, 6)), 4 * rng.normal(size=30), rng.uniform(-0.4, 0.4, 6)
    lower, upper = np.full(6, -0.5), np.full(6, 0.5)
    lower[0] = upper[0] = 0.3  # held
    residual = a @ x - b
    here = NormalEquations(0.5 * float(residual @ residual), a.T @ residual, a.T @ a)
    free = lsq_linear(a[:, 1:], b - 0.3 * a[:, 0], (lower[1:], upper[1:]), tol=1e-12, method="bvls")
    step, rise = step_in_box(here, x, lower, upper)
    np.testing.assert_allclose(x + step, [0.3, *free.x], atol=1e-7)
    assert here.cost + rise == pytest.approx(free.cost, rel=1e-9)


@pytest.mark.parametrize("rise", [1.0, 1e-2, 1e-6])
def test_a_step_that_raises_the_cost_is_not_taken(rise):
    """The quadratic promises a hundredth; every trial is higher than the start by `rise`."""

    def uphill(x: np.ndarray) -> NormalEquations:
        return NormalEquations(1.0 + rise * float(x[0] != 0.0), np.array([-0.02]), np.array([[0.02]]))

    solution = solve_bounded(uphill, np.zeros(1), -np.ones(1), 2.0 * np.ones(1), SolveLimits(evaluations=6))
    assert len(solution.costs) == 6
    assert (solution.x[0], solution.equations.cost) == (0.0, 1.0)
