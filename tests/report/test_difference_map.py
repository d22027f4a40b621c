# SPDX-License-Identifier: Apache-2.0
"""Colours and layout of the error maps."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.report.difference_map import difference_picture, draw_map, magma


def test_magma_is_matplotlibs():
    import matplotlib as mpl

    values = np.linspace(0, 1, 256)
    expected = np.array(mpl.colormaps["magma"].colors)
    np.testing.assert_allclose(magma(values), expected, atol=3 / 255)  # seventeen nodes of 256
    np.testing.assert_array_equal(magma(np.array([-1, 2, np.nan])), magma(np.array([0, 1, 0])))


@pytest.mark.parametrize(("shape", "scale"), [((20, 30), 13), ((256, 300), 1), ((2, 3000), 1)])
def test_the_map_lies_below_the_title_enlarged_by_a_whole_number(shape, scale):
    values = np.zeros(shape)
    values[0, 1] = 5.0
    picture = draw_map(values, maximum=5.0, title="")
    assert picture.dtype == np.float32
    levels = np.rint(picture[20 : 20 + shape[0] * scale, : shape[1] * scale] * 255)
    expected = np.rint(magma(values / 5).repeat(scale, axis=0).repeat(scale, axis=1) * 255)
    np.testing.assert_array_equal(levels, expected)


def test_bar_and_text_are_drawn():
    picture = draw_map(np.zeros((256, 256)), maximum=1.0, title="FLIP")
    bar = picture[20:276, 264:278]
    np.testing.assert_allclose(bar[0, 5], magma(np.array(1.0)), atol=2 / 255)
    np.testing.assert_allclose(bar[-1, 5], magma(np.array(0.0)), atol=2 / 255)
    assert picture[:20].max() > 0.5  # the title, its strokes smoothed
    assert picture[20:40, 280:].max() > 0.5  # the largest tick


def test_difference_picture_of_equal_images_is_black():
    image = np.random.default_rng(0).random((30, 20, 3)).astype(np.float32)
    scale = 13
    assert np.rint(difference_picture(image, image)[20 : 20 + 30 * scale, : 20 * scale].max() * 255) == 4  # magma(0)
    assert difference_picture(image, 1 - image)[20 : 20 + 30 * scale, : 20 * scale].max() > 0.5
