# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.solve.adam import Adam

BOX = (np.full(3, -10.0), np.full(3, 10.0))


def test_steps_follow_algorithm_1_of_kingma_and_ba() -> None:
    rng = np.random.default_rng(0)
    gradients = rng.normal(size=(20, 3))
    adam = Adam(*BOX, 0.05)
    x = np.zeros(3)
    mean, square, expected = [0.0] * 3, [0.0] * 3, [0.0] * 3
    for t, gradient in enumerate(gradients, start=1):
        x = adam.step(x, gradient)
        for i, g in enumerate(gradient):  # written out per entry from the paper's text
            mean[i] = 0.9 * mean[i] + 0.1 * g
            square[i] = 0.999 * square[i] + 0.001 * g * g
            expected[i] -= 0.05 * (mean[i] / (1 - 0.9**t)) / ((square[i] / (1 - 0.999**t)) ** 0.5 + 1e-12)
        np.testing.assert_allclose(x, expected, rtol=1e-12, atol=1e-14)  # float64 rounding of another order


def test_the_first_step_is_the_rate_whatever_the_size_of_the_gradient() -> None:
    rates = np.array([0.1, 0.2, 0.3])
    x = Adam(*BOX, rates).step(np.zeros(3), np.array([1e-6, -1.0, 1e6]))
    np.testing.assert_allclose(x, [-0.1, 0.2, -0.3], rtol=1e-5)  # epsilon 1e-12 against a slope of 1e-6


def test_steps_stay_inside_the_box() -> None:
    adam = Adam(np.zeros(3), np.ones(3), 0.5)
    x = np.array([0.1, 0.9, 0.5])
    for _ in range(5):
        x = adam.step(x, np.array([1.0, -1.0, 0.0]))
    np.testing.assert_array_equal(x, [0.0, 1.0, 0.5])


def test_reset_makes_it_a_new_optimisation() -> None:
    used, fresh = Adam(*BOX, 0.1), Adam(*BOX, 0.1)
    for _ in range(5):
        used.step(np.zeros(3), np.ones(3))
    gradient = np.array([-1.0, 2.0, 3.0])
    assert not np.array_equal(used.step(np.zeros(3), gradient), fresh.step(np.zeros(3), gradient))
    used.reset(), fresh.reset()
    np.testing.assert_array_equal(used.step(np.zeros(3), gradient), fresh.step(np.zeros(3), gradient))


def test_minimises_a_badly_scaled_bowl() -> None:
    scale, target = np.array([1.0, 100.0, 1e4]), np.array([0.3, -0.2, 0.7])
    adam, x = Adam(*BOX, 0.02), np.zeros(3)
    for i in range(600):
        adam.rate = np.full(3, 0.02 * 0.99**i)
        x = adam.step(x, 2.0 * scale * (x - target))
    np.testing.assert_allclose(x, target, atol=1e-3)  # the last steps are 5e-5 long


@pytest.mark.parametrize("gradient", [[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]])
def test_refuses_a_gradient_that_is_not_finite(gradient: list[float]) -> None:
    with pytest.raises(ValueError, match="finite"):
        Adam(*BOX).step(np.zeros(3), np.array(gradient))


def test_refuses_impossible_rates() -> None:
    with pytest.raises(ValueError, match="above 0"):
        Adam(*BOX, [0.1, 0.0, 0.1])
