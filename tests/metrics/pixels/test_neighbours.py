# SPDX-License-Identifier: Apache-2.0
"""Neighbours on small pictures, by hand and by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import convolve

from mfo_backend.metrics.pixels.neighbours import neighbour_pairs, sums_around


def test_pairs_are_all_that_touch_along_an_axis():
    shape = (3, 4)
    pixels = np.array([0, 1, 2, 3, 5, 9, 11])  # the first row; 5 and 9 below each other; 11 alone
    here, there = neighbour_pairs(pixels, shape)
    found = {(int(pixels[a]), int(pixels[b])) for a, b in zip(here, there, strict=True)}
    assert found == {(0, 1), (1, 2), (2, 3), (1, 5), (5, 9)}
    assert len(here) == len(found)


@pytest.mark.parametrize("reach", [1, 2])
def test_sums_are_those_of_a_box_filter(reach):
    picture = np.random.default_rng(reach).uniform(size=(5, 7))
    expected = convolve(picture, np.ones((2 * reach + 1, 2 * reach + 1)), mode="constant")
    np.testing.assert_allclose(sums_around(picture, reach), expected, rtol=1e-12)
