# SPDX-License-Identifier: Apache-2.0
"""Normal equations of two samples of the same rows. Oracle: those of rows without noise."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.traced.pictures import BRIGHT, is_unsure, two_half_equations

COUNT = 30_000


@pytest.fixture
def rows():
    rng = np.random.default_rng(0)
    return rng, rng.normal(scale=0.3, size=(COUNT, 3)).astype(np.float32)


def test_noise_of_the_halves_has_no_part_in_the_equations(rows):
    rng, clean = rows
    a, b = (clean + rng.normal(scale=0.5, size=clean.shape).astype(np.float32) for _ in range(2))
    equations = two_half_equations(a, b)
    error = 4.0 * 0.5**2 / np.sqrt(COUNT)  # four standard errors of a product of two noises
    assert equations.cost == pytest.approx(0.5 * np.mean(clean[:, 0] ** 2), abs=error)
    np.testing.assert_allclose(equations.gradient, clean[:, 1:].T @ clean[:, 0] / COUNT, atol=error)
    np.testing.assert_allclose(equations.hessian, clean[:, 1:].T @ clean[:, 1:] / COUNT, atol=error)


def test_one_bright_row_hides_nothing(rows):
    _, clean = rows
    spoilt = clean.copy()
    spoilt[7] = (400.0, 50.0, -90.0)
    expected, found = two_half_equations(clean, clean), two_half_equations(spoilt, spoilt)
    assert found.cost - expected.cost < 0.5 * BRIGHT**2 / COUNT
    np.testing.assert_allclose(found.hessian, expected.hessian, atol=1e-4)
    np.testing.assert_allclose(found.gradient, expected.gradient, atol=1e-4)


@pytest.mark.parametrize(("difference", "unsure"), [(0.0, True), (0.1, False)])
def test_it_is_unsure_where_the_halves_agree_on_nothing(difference, unsure):
    rng = np.random.default_rng(1)
    a, b = (difference + rng.normal(scale=0.3, size=(3000, 1)) for _ in range(2))
    assert is_unsure(a.astype(np.float32), b.astype(np.float32)) is unsure
