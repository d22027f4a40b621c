# SPDX-License-Identifier: Apache-2.0
"""A start that noise has put second is not lost: `refine` goes on with it where it is clearly better."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.recorded.solve import better_basin
from mfo_backend.solve.bounded_least_squares import NormalEquations


def two_valleys(x):
    """Residuals x^2 - 1 and (x - 1) / 10: the bottom is at 1, and there is a worse valley near -1."""
    residual = np.array([x[0] ** 2 - 1.0, 0.1 * (x[0] - 1.0)])
    jacobian = np.array([[2.0 * x[0]], [0.1]])
    return NormalEquations(0.5 * float(residual @ residual), jacobian.T @ residual, jacobian.T @ jacobian)


@pytest.mark.parametrize(
    ("others", "expected"),
    [([0.7], 1.0), ([-0.6, 1.4], 1.0), ([-0.7], None), ([], None)],
    ids=["better", "better second", "same valley", "none"],
)
def test_the_better_valley_is_gone_on_with(others, expected):
    setting = SimpleNamespace(
        plan=RecordedPlan(),
        table=SimpleNamespace(lower=np.array([-3.0]), upper=np.array([3.0])),
        course=SimpleNamespace(should_stop=lambda: False),
        sampled=True,
    )
    problem = SimpleNamespace(equations=two_valleys, independent=1e6, near=None)
    left = np.array([-0.995])
    assert two_valleys(left).cost > 0.019
    rival = better_basin(setting, problem, left, [np.array([x]) for x in others])
    assert (rival is None) == (expected is None)
    if rival is not None:
        assert rival[0] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("independent", "significant", "found"), [(5, True, False), (5, False, True), (20, True, True)]
)
def test_of_few_residuals_a_lower_cost_may_be_chance(independent, significant, found):
    """The valley at -0.995 costs 0.0199; that at 0.4 half of it: 2.5 of chi squared of 5 residuals, 10 of 20."""

    def equations(x):
        here = two_valleys(x)
        return NormalEquations(0.0199 - 0.01 * (x[0] > 0.0), 0.0 * here.gradient, here.hessian)

    setting = SimpleNamespace(
        plan=RecordedPlan(alike=significant),
        table=SimpleNamespace(lower=np.array([-3.0]), upper=np.array([3.0])),
        course=SimpleNamespace(should_stop=lambda: False),
        sampled=True,
    )
    problem = SimpleNamespace(equations=equations, independent=independent, near=None)
    left, right = np.array([-0.995]), np.array([0.4])
    rival = better_basin(setting, problem, left, [right])
    assert (rival is not None) is found
