# SPDX-License-Identifier: Apache-2.0
"""The curve of a fit as a picture: every end of a line lies where its loss and second say."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
from PIL import Image

from mfo_backend.report import curve_picture
from mfo_backend.report.curve_picture import SIZE, curve_png

from .test_loss_plot import stage


def middle_of(pixels: np.ndarray, colour: tuple[int, int, int], *, right_of: float = 0.0) -> list[tuple[float, float]]:
    """Leftmost and rightmost place (x, y) of a colour below the names of the stages."""
    rows, columns = np.nonzero((pixels[29:] == colour).all(axis=-1))
    return [(columns.min(), rows[columns == columns.min()].mean() + 29),
            (columns.max(), rows[columns == columns.max()].mean() + 29)]  # fmt: skip


def test_ends_of_the_lines() -> None:
    first = stage("mse", [(0.0, 1.0, 1.0), (5.0, 0.1, 0.1)])
    second = stage("flip", [(6.0, 0.03, 0.03), (10.0, 0.01, 0.01)])
    png = curve_png([first, second])
    assert png is not None
    pixels = np.asarray(Image.open(io.BytesIO(png)))
    assert pixels.shape == (SIZE[1], SIZE[0], 3)
    left, right = curve_picture._LEFT, SIZE[0] - curve_picture._RIGHT
    top, bottom = curve_picture._TOP, SIZE[1] - curve_picture._BOTTOM
    begin, end = middle_of(pixels, curve_picture._COLOURS[0])
    # the dots at the ends are 9 pixels wide
    assert begin == pytest.approx((left - 4, top), abs=8)
    assert end == pytest.approx((left + (right - left) / 2 + 4, (top + bottom) / 2), abs=2)
    begin, end = middle_of(pixels, curve_picture._COLOURS[1])
    assert begin[0] == pytest.approx(left + (right - left) * 0.6 - 4, abs=2)
    assert end == pytest.approx((right + 4, bottom), abs=8)


@pytest.mark.parametrize("values", [[], [(0.0, math.nan, math.nan)], [(0.0, 0.0, 0.0)]])
def test_nothing_to_draw(values: list) -> None:
    assert curve_png([stage("mse", values)]) is None


def test_one_point_and_one_value() -> None:
    assert curve_png([stage("mse", [(0.0, 0.5, 0.5)])]) is not None
    assert curve_png([stage("mse", [(0.0, 1.0, 1.0), (1.0, 1.0, 1.0)])]) is not None
