# SPDX-License-Identifier: Apache-2.0
"""Oracle: central differences through the residual."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.squares.residuals import (
    CensoredResidual,
    DisplayedResidual,
    OneSidedResidual,
    RelativeResidual,
    ResponseResidual,
    WeightedDisplayedResidual,
    WeightedResidual,
    log_residual,
    normal_equations,
    residual_rows,
)
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.responses.itp import Itp
from mfo_backend.metrics.responses.pu21 import Pu21

from ...metrics.display.view_tables import baked, filmic

RNG = np.random.default_rng(2)
REFERENCE = RNG.uniform(0.05, 2.0, (50, 3))
BASIS = RNG.uniform(-0.3, 0.3, (50, 3, 4))
OFFSET = RNG.uniform(1.0, 2.0, (50, 3))


def table(x: np.ndarray) -> np.ndarray:
    image = OFFSET + BASIS @ x
    return np.concatenate([image[:, :, None], BASIS], axis=2)


@pytest.mark.parametrize(
    "residual",
    [
        log_residual(REFERENCE),
        ResponseResidual(Pu21(80.0), REFERENCE),
        ResponseResidual(Itp(80.0), REFERENCE),
        CensoredResidual(log_residual(REFERENCE), REFERENCE, 1.2),
    ],
    ids=["log", "pu21", "itp", "censored"],
)
def test_rows_are_derivatives(residual):
    x, h = np.array([0.1, -0.2, 0.3, 0.2]), 1e-5
    rows = residual_rows(table(x), residual)
    for k in range(4):
        step = h * np.eye(4)[k]
        difference = (residual_rows(table(x + step), residual) - residual_rows(table(x - step), residual))[:, :, 0] / (
            2 * h
        )
        # float64 here: float32 rounding alone is worth 0.03 just noticeable differences of ITP
        np.testing.assert_allclose(rows[:, :, 1 + k], difference, atol=1e-6 * np.abs(rows).max())


def test_equations_are_those_of_the_rows():
    x = np.array([0.1, -0.2, 0.3, 0.2])
    residual = log_residual(REFERENCE)
    rows = residual_rows(table(x), residual).reshape(-1, 5)
    equations = normal_equations(table, residual)(x)
    assert equations.cost == pytest.approx(0.5 * np.mean(rows[:, 0] ** 2))
    np.testing.assert_allclose(equations.gradient, rows[:, 1:].T @ rows[:, 0] / len(rows))
    np.testing.assert_allclose(equations.hessian, rows[:, 1:].T @ rows[:, 1:] / len(rows))


def test_nothing_is_seen_above_a_clipped_reference():
    reference = np.full((1, 3), 1.0, np.float32)
    residual = CensoredResidual(log_residual(reference), reference, 1.0)
    values, slope = residual(np.array([[0.5, 1.0, 7.0]], np.float32))
    assert values[0, 0] < 0.0
    np.testing.assert_allclose(values[0, 1:], 0.0, atol=1e-7)
    assert slope[0, 2] == 0.0


def test_the_relative_residual_is_unbiased_under_noise_of_the_reference():
    rng = np.random.default_rng(0)
    truth = np.full((20_000, 3), 0.5, np.float32)
    noisy = (truth * rng.exponential(1.0, truth.shape)).astype(np.float32)
    values, _ = RelativeResidual(noisy)(truth)
    assert abs(values.mean()) < 0.02  # 60 000 values of standard deviation 1
    log_values, _ = log_residual(noisy)(truth)
    assert log_values.mean() > 0.05  # which is why it is used


def test_a_relative_residual_is_relative_to_the_image_and_a_tenth_of_the_mean_reference():
    reference = np.array([[0.1, 0.2, 0.6]], np.float32)  # of the mean 0.3
    values, slope = RelativeResidual(reference)(np.array([[0.17, 0.07, 0.6]], np.float32))
    np.testing.assert_allclose(values, [[0.07 / 0.2, -0.13 / 0.1, 0.0]], rtol=1e-5)
    np.testing.assert_allclose(slope, [[1.0 / 0.2, 1.0 / 0.1, 1.0 / 0.63]], rtol=1e-5)


def test_weighted_residual_has_its_slope_and_bounds_what_one_outlier_counts():
    weight = np.full(REFERENCE.shape, 5.0)
    residual = WeightedResidual(REFERENCE, weight)
    image = REFERENCE + RNG.uniform(-2.0, 2.0, REFERENCE.shape)  # up to 10 standard deviations
    values, slope = residual(image)
    step = 1e-5
    up, down = (residual(image + s * step)[0] for s in (1, -1))
    np.testing.assert_allclose(slope, (up - down) / (2 * step), rtol=2e-3)
    near = np.abs(image - REFERENCE) < 0.8
    np.testing.assert_allclose(values[near], 5.0 * (image - REFERENCE)[near], rtol=1e-5)
    # influence, value times slope: that of a firefly is below that of an ordinary pixel
    firefly_value, firefly_slope = residual(REFERENCE + 1000.0)
    assert (firefly_value * firefly_slope < 5.0 * 0.1).all()
    assert (firefly_value < 20.0).all()


def test_the_log_of_a_picture_that_is_black_but_for_a_highlight_does_not_look_into_the_black():
    reference = np.full((100, 3), 1e-4, np.float32)
    reference[:5] = 2.0
    residual = log_residual(reference)
    brighter = reference.copy()
    brighter[5:] *= 5.0  # by four thousandths of the mean
    # on the curve of the median itself it would be log(16 / 4) = 1.4, fifteen times a tenth more of the highlight
    assert np.abs(residual(brighter)[0]).max() < 0.15


STANDARD = baked(DisplayView().display)


def test_derivative_against_central_differences():
    rng = np.random.default_rng(1)
    residual = DisplayedResidual(baked(filmic), np.exp2(rng.uniform(-4, 2, (50, 3))))
    image = np.exp2(rng.uniform(-4, 4, (50, 3)))
    slope = residual(image)[1]
    for channel in range(3):
        step = 1e-6 * image * np.eye(3)[channel]
        expected = (residual(image + step)[0] - residual(image - step)[0]) / step.sum(axis=-1, keepdims=True) / 2
        # 1e-16 / 1e-6 of rounding; the table itself is float32
        np.testing.assert_allclose(slope[:, :, channel], expected, rtol=1e-5, atol=1e-7)


def test_an_image_brighter_than_a_clipped_reference_agrees_with_it():
    reference = np.array([[3.0, 0.5, 0.2]], np.float32)
    values, slope = DisplayedResidual(STANDARD, reference)(np.array([[9.0, 0.5, 0.2]], np.float32))
    np.testing.assert_array_equal(values, 0)
    np.testing.assert_array_equal(slope[0, 0], 0)
    assert (np.diagonal(slope[0])[1:] > 0.3).all()
    # half a level of 8 bits below the top is the top
    nearly = DisplayedResidual(STANDARD, np.full((1, 3), 0.997, np.float32))
    for found in nearly(np.full((1, 3), 0.999, np.float32)):
        np.testing.assert_array_equal(found, 0)
    values, slope = DisplayedResidual(STANDARD, reference)(np.array([[0.8, 0.5, 0.2]], np.float32))
    assert values[0, 0] < -0.05
    assert slope[0, 0, 0] > 0.3


def test_an_image_above_white_finds_back_to_an_unclipped_reference():
    values, slope = DisplayedResidual(STANDARD, np.array([[0.5, 0.5, 0.5]], np.float32))(np.full((1, 3), 8.0, "f"))
    # 3 stops at 0.05 a stop on top of the difference from white
    np.testing.assert_allclose(values, 1 - STANDARD.display(np.full((1, 3), 0.5)) + 0.15, atol=1e-4)
    np.testing.assert_allclose(slope[0], np.eye(3) * 0.05 / np.log(2) / 8, rtol=1e-4)


def test_mean_of_partly_clipped_pixels_is_a_lower_bound():
    reference, image = np.full((2, 3), 0.5, np.float32), np.array([[0.7, 0.3, 0.7], [0.7, 0.3, 0.7]], np.float32)
    at_least = np.array([[True, True, False], [False, False, False]])
    for plain in (RelativeResidual(reference), DisplayedResidual(STANDARD, reference)):
        (values, slope), (all_values, all_slope) = OneSidedResidual(plain, at_least)(image), plain(image)
        keep = np.array([[False, True, True], [True, True, True]])
        np.testing.assert_array_equal(values[keep], all_values[keep])
        np.testing.assert_array_equal(slope[keep], all_slope[keep])
        assert values[0, 0] == 0
        assert not np.any(slope[0, 0])
        assert (all_values[:, 0] > 0).all()


def test_what_a_view_shows_of_noise_counts_in_its_standard_deviations():
    rng = np.random.default_rng(3)
    light = np.exp2(rng.uniform(-3, 0, (4000, 3)))
    deviation = 0.05 * light
    residual = WeightedDisplayedResidual(baked(filmic), light, (1.0 / deviation).astype(np.float32))
    values, slope = residual(light + deviation * rng.standard_normal(light.shape))
    assert 0.92 < values.std() < 1.0  # the least that counts takes a little away
    step = 1e-5 * light
    expected = residual(light + step * np.eye(3)[1])[0] - residual(light - step * np.eye(3)[1])[0]
    centre = residual(light)[1][:, :, 1]
    np.testing.assert_allclose(centre, expected / (2.0 * step[:, 1:2]), rtol=1e-3, atol=1e-3)
    # a firefly counts no more than in light
    far, far_slope = residual(8.0 * light)
    assert np.abs(far).max() < 16.0
    assert np.abs(far_slope).max() < np.abs(slope).max()


def test_without_noise_a_view_s_residual_counts_levels_of_eight_bits():
    light = np.full((1, 3), 0.4)
    residual = WeightedDisplayedResidual(STANDARD, light, np.full((1, 3), 1e9, np.float32))
    shown = STANDARD.display(light) + 0.004
    np.testing.assert_allclose(residual(STANDARD.linear(shown))[0], 2.0, rtol=1e-2)
