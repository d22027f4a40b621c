# SPDX-License-Identifier: Apache-2.0
"""Pictures of one value in closed form: which of them is named, and when none is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mfo_backend.fit.pictures.contradiction import contradiction

TILES = 40  # of a picture
BOX = np.zeros(1), np.ones(1)


def problem(*pictures: Any, seed: int = 0) -> tuple[Any, np.ndarray]:
    """Residuals in deviations of the noise: polynomials of the value for each picture, beside that noise."""
    noise = 0.3 * np.random.default_rng(seed).normal(size=(len(pictures), TILES, 3))

    def evaluate(x: np.ndarray) -> np.ndarray:
        rows = np.empty((len(pictures), TILES, 3, 2))
        for number, polynomial in enumerate(pictures):
            rows[number, :, :, 0] = polynomial(x[0]) + noise[number]
            rows[number, :, :, 1] = polynomial.deriv()(x[0])
        return rows.reshape(-1, 3, 2)

    def residual(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return image, np.ones_like(image)

    return SimpleNamespace(evaluate=evaluate, residual=residual), np.repeat(np.arange(len(pictures)), TILES)


def line(zero: float, slope: float = 10.0) -> np.polynomial.Polynomial:
    return slope * np.polynomial.Polynomial([-zero, 1.0])


@pytest.mark.parametrize(("zeros", "named"), [((0.3, 0.3, 0.3), None), ((0.3, 0.8, 0.3), ("b",))])
def test_the_picture_of_another_value_is_named(zeros: tuple[float, ...], named: tuple[str, ...] | None) -> None:
    both, numbers = problem(*map(line, zeros))
    found = contradiction(both, both, numbers, "abc", np.array([np.mean(zeros)]), BOX)
    assert (found and found.pictures) == named


def test_a_fit_that_ended_in_another_basin_is_no_contradiction() -> None:
    """One picture allows two values and the other one of them: all together began at the wrong one."""
    two = 10.0 * np.polynomial.Polynomial.fromroots([0.2, 0.9])
    both, numbers = problem(two, line(0.2, 3.0))
    wrong = np.array([0.86])
    assert np.square(both.evaluate(wrong)[:, :, 0]).mean() > 1.21
    assert contradiction(both, both, numbers, "ab", wrong, BOX) is None
    apart, numbers = problem(4.0 * two, line(0.5, 40.0))
    assert contradiction(apart, apart, numbers, "ab", wrong, BOX) is not None
