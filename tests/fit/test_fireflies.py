# SPDX-License-Identifier: Apache-2.0
"""Pixels far brighter than others."""

from __future__ import annotations

import numpy as np

from mfo_backend.fit.fireflies import dim_fireflies, without_fireflies


def test_pixels_brighter_than_the_limit_keep_their_colour_and_slopes():
    tables = np.random.default_rng(0).uniform(0.1, 1.0, (2, 5, 3, 4)).astype(np.float32)
    tables[1, 2, :, 0] = 4.0, 8.0, 2.0
    before = tables.copy()
    dim_fireflies(tables, 2.0)
    np.testing.assert_allclose(tables[1, 2], 0.25 * before[1, 2], rtol=1e-6)
    others = np.ones((2, 5), bool)
    others[1, 2] = False
    np.testing.assert_array_equal(tables[others], before[others])


def test_a_single_bright_pixel_is_replaced_by_those_around_it():
    image = np.full((9, 9, 3), 0.5, np.float32)
    image[4, 4] = 40.0
    image[0, :] = 40.0  # a bright edge is none
    clean, count = without_fireflies(image, np.ones((9, 9), bool))
    assert count == 1
    np.testing.assert_allclose(clean[4, 4], 0.5)
    np.testing.assert_array_equal(clean[0], image[0])
