# SPDX-License-Identifier: Apache-2.0
"""What a problem says of its own noise and of a change, on numbers that are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.squares.problem import Problem, Refined, Rival
from mfo_backend.render.paths.recorded_image import TwoSamples
from mfo_backend.types.parameter import Parameter, ParameterTable

RADIANCE, GROUPS = 2.0, 20_000


def problem(noise: float | None, error: float = 0.0) -> Problem:
    """Of an image of x times the radiance against `1 + error` times it; each of the two samples has this noise."""
    draw = np.random.default_rng(1).normal(size=(2, GROUPS, 3, 2)) * (noise or 0.0) * RADIANCE

    def samples(x: np.ndarray) -> TwoSamples:
        exact = np.full((GROUPS, 3, 2), RADIANCE) * [x[0], 1.0]
        mean = exact + draw.mean(axis=0)
        return TwoSamples(mean, None if noise is None else 0.5 * (draw[0] - draw[1]))

    evaluate = SimpleNamespace(samples=samples)
    reference = RADIANCE * (1.0 + error)

    def residual(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (image - reference) / RADIANCE, np.full_like(image, 1.0 / RADIANCE)

    return Problem(evaluate, residual, range(GROUPS))


@pytest.mark.parametrize("error", [0.0, 0.1, 0.4])
def test_the_share_of_own_noise_is_its_part_of_the_mean_square(error):
    # the mean of two samples has half their variance
    own = 0.2**2 / 2.0
    assert problem(0.2, error).own_share(np.array([1.0])) == pytest.approx(own / (own + error**2), rel=0.03)
    assert problem(None, error).own_share(np.array([1.0])) == 0.0


def test_own_noise_is_relative_to_the_radiance_and_a_tenth_of_its_mean():
    assert problem(0.01).own_noise(np.array([3.0])) == pytest.approx(0.01 / np.sqrt(2.0) / 3.3, rel=0.02)
    assert problem(None).own_noise(np.array([3.0])) == 0.0


def test_the_share_is_at_most_one_where_the_halves_differ_by_more_than_the_residual():
    apart = np.ones((4, 3, 2))
    evaluate = SimpleNamespace(samples=lambda x: TwoSamples(0.5 * apart, apart))
    exact = Problem(evaluate, lambda image: (image, np.ones_like(image)), range(4))
    assert exact.own_share(np.zeros(1)) == 1.0


def test_a_solution_and_its_rivals_are_told_by_the_nearest_turn():
    table = ParameterTable(
        [Parameter("roughness", 1, 0.0, 1.0, 0.5), Parameter("anisotropic_rotation", 1, 0.0, 1.0, 0.0, period=0.5)]
    )
    rival = Rival(np.array([0.7, 0.1]), 0.2)
    refined = Refined(np.array([0.3, 0.55]), problem(None), problem(None), rivals=(rival,), richer=(rival.x,))
    found = refined.near(table, np.array([0.5, 0.0]))
    np.testing.assert_allclose(found.x, [0.3, 0.05])
    np.testing.assert_allclose(found.rivals[0].x, [0.7, 0.1])
    np.testing.assert_allclose(refined.near(table, np.array([0.5, 0.9])).rivals[0].x, [0.7, 0.6])
