# SPDX-License-Identifier: Apache-2.0
"""Oracle: scipy's bounded-variable least squares on the same problem."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from mfo_backend.solve.box_quadratic import minimise_in_box


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("size", [1, 4, 13])
def test_equals_bounded_variable_least_squares(seed, size):
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(size + 3, size)), rng.normal(size=size + 3)
    lower, upper = -rng.uniform(0, 0.4, size), rng.uniform(0, 0.4, size)
    expected = lsq_linear(a, b, (lower - 1e-15, upper + 1e-15), method="bvls", tol=1e-14).x
    got = minimise_in_box(a.T @ a, -a.T @ b, lower, upper)
    np.testing.assert_allclose(got, expected, atol=1e-9)  # float64 normal equations of condition up to 1e4
    assert (got >= lower).all()
    assert (got <= upper).all()


def test_equal_bounds_hold_a_value():
    hessian = np.array([[2.0, 1.0], [1.0, 2.0]])
    got = minimise_in_box(hessian, np.array([-1.0, -1.0]), np.array([0.0, -5.0]), np.array([0.0, 5.0]))
    np.testing.assert_allclose(got, [0.0, 0.5], atol=1e-15)


@pytest.mark.parametrize("at", [0.5, -0.5])
def test_a_value_may_be_held_elsewhere_than_at_zero(at):
    hessian, gradient = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-1.0, -1.0])
    got = minimise_in_box(hessian, gradient, np.array([at, -5.0]), np.array([at, 5.0]))
    np.testing.assert_allclose(got, [at, (1.0 - at) / 2.0], atol=1e-15)


def test_an_indefinite_matrix_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        minimise_in_box(np.diag([1.0, -1.0]), np.ones(2), -np.ones(2), np.ones(2))
