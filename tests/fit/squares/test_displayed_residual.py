# SPDX-License-Identifier: Apache-2.0
"""The residual of display values: its slopes, and the one side of residuals where the reference is clipped."""

from __future__ import annotations

import numpy as np

from mfo_backend.fit.squares.residuals import DisplayedResidual, OneSidedResidual, RelativeResidual
from mfo_backend.metrics.tone_mapping import DisplayView

from ...metrics.view_tables import baked, filmic

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
