# SPDX-License-Identifier: Apache-2.0
"""Pixels far brighter than others."""

from __future__ import annotations

import numpy as np

from mfo_backend.fit.recorded.fireflies import without_fireflies


def test_a_single_bright_pixel_is_replaced_by_those_around_it():
    image = np.full((9, 9, 3), 0.5, np.float32)
    image[4, 4] = 40.0
    image[0, :] = 40.0  # a bright edge is none
    clean, count = without_fireflies(image, np.ones((9, 9), bool))
    assert count == 1
    np.testing.assert_allclose(clean[4, 4], 0.5)
    np.testing.assert_array_equal(clean[0], image[0])
