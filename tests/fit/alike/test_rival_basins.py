# SPDX-License-Identifier: Apache-2.0
"""A start that noise has put second is not lost: `refine` goes on with it where it is clearly better."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.recorded.stages import RecordedFit
from mfo_backend.fit.squares.problem import Refined
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
    fit = RecordedFit.__new__(RecordedFit)
    fit.plan = RecordedPlan()
    fit.table = SimpleNamespace(lower=np.array([-3.0]), upper=np.array([3.0]))
    fit.course = SimpleNamespace(should_stop=lambda: False)
    fit.scene = SimpleNamespace(needs=SimpleNamespace(sampled=True))
    problem = SimpleNamespace(equations=two_valleys, independent=1e6, near=None)
    left = np.array([-0.995])
    assert two_valleys(left).cost > 0.019
    rival = fit._rival(problem, left, [np.array([x]) for x in others])
    assert (rival is None) == (expected is None)
    if rival is not None:
        assert rival[0] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(("cost_there", "kept"), [(0.4, "rival"), (0.6, "found")])
def test_a_rival_has_to_be_better_on_a_recording_of_its_own(monkeypatch, cost_there, kept):
    """On a recording made for another material its own noise may pass for a lower cost."""
    fit = RecordedFit.__new__(RecordedFit)
    found, rival = np.array([0.0]), np.array([1.0])
    recorded = [(found, 7)]

    def recorded_near(stage, start, make, weigh):
        at, grid = (found, 7) if start is not rival else (rival, 9)
        recorded.append((at, grid))
        return at, grid

    def problems(x, make, weigh, *, solve_all=False):
        few = SimpleNamespace(equations=lambda at: SimpleNamespace(cost=cost_there if at is rival else 0.5))
        return Refined(x, few, few)

    monkeypatch.setattr(fit, "_recorded_near", recorded_near)
    monkeypatch.setattr(fit, "_problems", problems)
    monkeypatch.setattr(fit, "_rival", lambda problem, x, others: rival)
    monkeypatch.setattr(fit, "_record", lambda x, grid: recorded.append((x, grid)))
    monkeypatch.setattr(fit, "_solve", lambda problem, x, evaluations, *, stage: SimpleNamespace(x=x))
    refined = fit._refine_sampled(SimpleNamespace(vector=None), found, None, None, [rival])
    expected = rival if kept == "rival" else found
    assert refined.x is expected
    assert recorded[-1] == ((rival, 9) if kept == "rival" else (found, 7))
