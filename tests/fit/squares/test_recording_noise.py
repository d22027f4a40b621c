# SPDX-License-Identifier: Apache-2.0
"""Oracles: the equations without noise, central differences of the cost, eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.squares.recording_noise import (
    MOST_OWN,
    MOST_TAKEN,
    rows_of_samples,
    unbiased_equations,
    without_own_noise,
)
from mfo_backend.fit.squares.residuals import RelativeResidual, WeightedResidual, log_residual, normal_equations
from mfo_backend.render.paths.recorded_image import TwoSamples

RNG = np.random.default_rng(7)
GROUPS = 4000
TRUTH = np.array([0.4, 0.6, 0.3])
BASIS = RNG.uniform(0.2, 0.8, (GROUPS, 3, 3))
OFFSET = RNG.uniform(1.0, 2.0, (GROUPS, 3))


def table(x: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """An image that the last value makes noisier, as a narrow lobe does, with its derivatives."""
    image = OFFSET + BASIS @ x + noise * x[2]
    columns = BASIS.copy()
    columns[:, :, 2] += noise
    return np.concatenate([image[:, :, None], columns], axis=2)


def two_samples(seed: int, size: float = 1.0):
    noise = np.random.default_rng(seed).normal(size=(2, GROUPS, 3)) * size
    return lambda x: TwoSamples.of(np.stack([table(x, n) for n in noise]), np.zeros((GROUPS, 3)))


def reference(seed: int) -> np.ndarray:
    return OFFSET + BASIS @ TRUTH + 0.3 * np.random.default_rng([seed, 1]).normal(size=(GROUPS, 3))


@pytest.mark.parametrize("x", [TRUTH, np.array([0.5, 0.2, 0.45])], ids=["truth", "elsewhere"])
def test_equations_are_those_without_own_noise_on_average(x):
    weight = np.full((GROUPS, 3), 1.0 / 0.3)
    clean, found, plain = [], [], []
    for seed in range(20):
        residual = WeightedResidual(reference(seed), weight / 10)  # none is beyond the limit of its influence
        samples = two_samples(seed)
        equations = unbiased_equations(samples, residual, TRUTH)
        at = equations(x)
        clean.append(normal_equations(lambda v: table(v, np.zeros((GROUPS, 3))), residual)(x))
        there = float(np.mean(np.square(rows_of_samples(samples(TRUTH), residual)[1][:, :, 0])))
        found.append((at.cost - 0.5 * there, at.gradient, at.hessian))
        plain.append(normal_equations(lambda v, samples=samples: samples(v).mean, residual)(x))
        # made there, the problem has the cost of plain squares
        assert unbiased_equations(samples, residual, x)(x).cost == pytest.approx(plain[-1].cost, rel=1e-9)
    spread = np.std([f[1] for f in found], axis=0) / np.sqrt(20)
    for part, name in enumerate(("cost", "gradient", "hessian")):
        expected = np.mean([getattr(c, name) for c in clean], axis=0)
        got = np.mean([f[part] for f in found], axis=0)
        np.testing.assert_allclose(got, expected, rtol=0.03, atol=4.0 * spread.max())
    # the noisier value has the bias that is taken away: its share of the gradient is 0.5 x[2] of the noise's square
    biased = np.mean([p.gradient for p in plain], axis=0) - np.mean([c.gradient for c in clean], axis=0)
    assert biased[2] > 10.0 * spread[2]


@pytest.mark.parametrize(
    "residual",
    [RelativeResidual(reference(0)), log_residual(reference(0)), WeightedResidual(reference(0), np.ones((GROUPS, 3)))],
    ids=["relative", "log", "weighted"],
)
def test_without_own_noise_they_are_the_normal_equations(residual):
    def samples(x):
        return TwoSamples(table(x, np.zeros((GROUPS, 3))), None)

    x = np.array([0.5, 0.2, 0.4])
    got, expected = (
        unbiased_equations(samples, residual, TRUTH)(x),
        normal_equations(lambda v: samples(v).mean, residual)(x),
    )
    assert got.cost == expected.cost
    np.testing.assert_array_equal(got.gradient, expected.gradient)
    np.testing.assert_array_equal(got.hessian, expected.hessian)


def test_the_gradient_is_that_of_the_cost():
    equations = unbiased_equations(two_samples(3), WeightedResidual(reference(3), np.ones((GROUPS, 3))), TRUTH)
    x, h = np.array([0.5, 0.2, 0.4]), 1e-4
    differences = [(equations(x + h * e).cost - equations(x - h * e).cost) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(equations(x).gradient, differences, rtol=1e-4)


def test_no_more_is_taken_than_a_few_times_the_noise_there_was():
    residual = WeightedResidual(reference(4), np.full((GROUPS, 3), 0.1))
    samples = two_samples(4, size=2.0)
    near = np.array([0.4, 0.6, 0.05])
    far = np.array([0.4, 0.6, 0.05 * np.sqrt(MOST_TAKEN) * 1.5])
    own = float(np.mean(np.square(rows_of_samples(samples(near), residual)[1][:, :, 0])))
    plain = normal_equations(lambda v: samples(v).mean, residual)(far)
    got = unbiased_equations(samples, residual, near)(far)
    assert got.cost == pytest.approx(plain.cost - 0.5 * (MOST_TAKEN - 1.0) * own)
    np.testing.assert_array_equal(got.gradient, plain.gradient)


def test_what_is_left_of_the_products_is_never_negative():
    rows = RNG.normal(size=(100, 4))
    gram, own = rows.T @ rows, np.diag([0.0, 50.0, 500.0, 0.0])
    left = without_own_noise(gram, own)
    shares = np.linalg.eigvals(np.linalg.solve(gram, left)).real
    assert shares.min() == pytest.approx(1.0 - MOST_OWN, rel=1e-6)
    np.testing.assert_allclose(without_own_noise(gram, 0.1 * gram), 0.9 * gram, rtol=1e-9, atol=1e-9)
    assert np.abs(without_own_noise(np.zeros((2, 2)), np.zeros((2, 2)))).max() < 1e-300


def test_numbers_that_are_not_finite_are_handed_on():
    def samples(x):
        return TwoSamples(np.full((4, 3, 3), np.nan), np.zeros((4, 3, 3)))

    equations = unbiased_equations(samples, WeightedResidual(np.ones((4, 3)), np.ones((4, 3))), np.zeros(2))
    assert not equations(np.zeros(2)).finite


def test_a_cost_stays_positive_where_the_mean_of_both_samples_hits_the_reference():
    exact = table(TRUTH, np.zeros((GROUPS, 3)))
    residual = WeightedResidual(exact[:, :, 0].astype(np.float32), np.full((GROUPS, 3), 10.0))
    noise = np.random.default_rng(4).normal(size=exact.shape)

    def samples(x):
        return TwoSamples((exact + 0.01 * x[0]).astype(np.float32), (0.01 * (1.0 + x[1]) * noise).astype(np.float32))

    at = unbiased_equations(samples, residual, np.zeros(3))
    assert at(np.array([0.1, 0.0, 0.0])).cost > 0.0
    assert at(np.array([0.1, 0.5, 0.0])).cost > 0.0  # there own noise is 2.25 times that where the problem was made
    assert at(np.array([0.1, 2.0, 0.0])).cost > 0.0  # and here too far from it
