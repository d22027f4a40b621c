# SPDX-License-Identifier: Apache-2.0
"""Lobes that go off in the last steps, on problems made by hand; oracle: `scipy.optimize.lsq_linear`."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from mfo_backend.fit.alike.unneeded_lobes import box_holding, solve_without_unneeded, with_user_details
from mfo_backend.fit.tolerances import SIGNIFICANT
from mfo_backend.solve.bounded_least_squares import NormalEquations, SolveLimits, solve_bounded
from mfo_backend.types.parameter import Parameter, ParameterTable

NAMES = ("roughness", "specular", "sheen", "coat")
TABLE = ParameterTable(Parameter(name, 1, 0.0, 1.0, 0.0) for name in NAMES)
USER = TABLE.pack({"roughness": 0.5, "specular": 0.5, "sheen": 0.0, "coat": 0.0})
COUNT = 400  # independent residuals


class Problem:
    """Linear residuals of unit noise; below sheen 0.1 one more grows by `bend`, of which no derivative knows."""

    def __init__(self, truth, deviations, *, bend=0.0, seed=0):
        rng = np.random.default_rng(seed)
        columns = np.linalg.qr(rng.normal(size=(COUNT, len(NAMES) + 1)))[0]
        self._jacobian = columns[:, :-1] / np.asarray(deviations)
        self._bent, self._bend = columns[:, -1], bend
        noise = rng.normal(size=COUNT)  # less what the columns could explain: the best values are the true ones
        self._data = self._jacobian @ np.asarray(truth) + noise - columns @ (columns.T @ noise)
        self.solved = []

    def equations(self, x):
        away = min(x[2] - 0.1, 0.0)
        residual = self._jacobian @ x - self._data + self._bend * away * self._bent
        gradient, gram = (self._jacobian.T @ right / COUNT for right in (residual, self._jacobian))
        return NormalEquations(0.5 * float(residual @ residual) / COUNT, gradient, gram)

    def solve(self, start, box):
        self.solved.append(box)
        limits = SolveLimits(cost_change=1e-9, damping=1e-9)
        return solve_bounded(self.equations, start, *box, limits)

    def best(self, box):
        free = box[1] > box[0]
        fixed = self._data - self._jacobian[:, ~free] @ box[0][~free]
        x = box[0].copy()
        x[free] = lsq_linear(self._jacobian[:, free], fixed, (box[0][free], box[1][free]), tol=1e-12).x
        return x


def end_of(problem, x):
    end, off = solve_without_unneeded(problem.solve, problem.equations(x), COUNT, x, USER, TABLE)
    return end.x, off


@pytest.mark.parametrize(
    ("sheen", "coat", "off"),
    [(0.02, 0.02, ("sheen", "coat")), (0.6, 0.02, ("coat",)), (0.6, 0.6, ())],
    ids=["neither", "sheen", "both"],
)
def test_what_three_deviations_ask_for_stays(sheen, coat, off):
    problem = Problem([0.4, 0.6, sheen, coat], [0.02, 0.02, 0.05, 0.05])
    x, found = end_of(problem, np.array([0.42, 0.58, 0.3, 0.3]))
    assert set(found) == set(off)
    box = box_holding(TABLE, USER, off)
    np.testing.assert_allclose(x, problem.best(box), atol=2e-4)
    assert len(problem.solved) == 1  # the quadratic told, no solve was made for it


def test_a_lobe_that_the_quadratic_takes_for_unneeded_stays_where_the_picture_asks_for_it():
    bent = 2.0 * np.sqrt(SIGNIFICANT)  # deviations, from sheen 0.1 to 0
    problem = Problem([0.4, 0.6, 0.1, 0.0], [0.02, 0.02, 0.05, 0.05], bend=10.0 * bent)
    x, found = end_of(problem, np.array([0.4, 0.6, 0.1, 0.0]))
    assert found == ()
    assert len(problem.solved) == 2
    assert x[2] > 0.02


def test_values_of_the_user_that_are_on_are_no_lobes():
    problem = Problem([0.5, 0.5, 0.6, 0.6], [5.0, 5.0, 0.05, 0.05])
    _, found = end_of(problem, np.array([0.4, 0.6, 0.6, 0.6]))
    assert found == ()


def test_details_of_a_lobe_that_is_off_are_the_users():
    """Noise had chosen them, and derivatives of the lobe's weight depend on them."""
    table = ParameterTable(
        Parameter(n, 1, 0.0, 1.0, 0.0) for n in ("sheen_weight", "sheen_roughness", "coat_roughness")
    )
    user = np.array([0.3, 0.5, 0.1])
    np.testing.assert_array_equal(with_user_details(np.array([0.0, 0.9, 0.8]), user, table), [0.0, 0.5, 0.8])
    np.testing.assert_array_equal(with_user_details(np.array([0.1, 0.9, 0.8]), user, table), [0.1, 0.9, 0.8])
