# SPDX-License-Identifier: Apache-2.0
"""What is painted over a view, laid there as Blender does; oracle: IEC 61966-2-1 by an inverse of its own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

PICTURE = np.random.default_rng(5).random((24, 40, 4), dtype=np.float32)
PICTURE[..., 3] = 1.0
PICTURE[0, :3, :3] = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [1.0, 0.0, 0.0]]


def in_light(display: NDArray[np.float64]) -> NDArray[np.float64]:
    """By interpolation in a fine table of the encoding."""
    light = np.linspace(0.0, 1.0, 200_001)
    table = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.interp(display, table, light)


def laid_over(paint: NDArray[np.float32], view: NDArray[np.float32]) -> NDArray[np.float64]:
    """Display values of a view under paint of 8 bits a channel, as Blender's windows show them."""
    levels = np.rint(np.asarray(paint, np.float64) * 255.0) / 255.0
    a = levels[..., 3:]
    return (a * in_light(levels[..., :3]) + (1.0 - a) * np.asarray(view, np.float64) ** 2.2) ** (1.0 / 2.2)


def test_a_view_like_the_picture_is_grey_all_over() -> None:
    from blender_addon.pictures.view_paint import NEUTRAL, difference

    seen = laid_over(difference(PICTURE), PICTURE[..., :3])
    assert seen == pytest.approx(NEUTRAL, abs=0.006)  # half a level of the opacity is 0.002 of the light


@pytest.mark.parametrize("grey", [0.15, 0.3, 0.5, 0.7, 0.9])
def test_a_brighter_view_is_lighter_and_a_darker_one_darker(grey: float) -> None:
    from blender_addon.pictures.view_paint import NEUTRAL, difference

    picture = np.array([[[grey, grey, grey, 1.0]]], np.float32)
    shown = [laid_over(difference(picture), picture[..., :3] + step)[0, 0] for step in (-0.05, 0.05)]
    assert (shown[0] < NEUTRAL - 0.01).all()
    assert (shown[1] > NEUTRAL + 0.01).all()


def test_only_the_channel_that_differs_leaves_the_grey() -> None:
    from blender_addon.pictures.view_paint import NEUTRAL, difference

    redder = PICTURE[..., :3].copy()
    redder[..., 0] = np.minimum(redder[..., 0] + 0.1, 1.0)
    seen = laid_over(difference(PICTURE), redder)
    assert seen[..., 1:] == pytest.approx(NEUTRAL, abs=0.006)
    assert np.mean(seen[..., 0] > NEUTRAL + 0.005) > 0.9


def test_nothing_is_painted_where_the_picture_has_nothing() -> None:
    from blender_addon.pictures.view_paint import difference, split, whole

    picture = PICTURE.copy()
    picture[:12, :, 3] = 0.0
    assert not difference(picture)[:12, :, 3].any()
    assert not split(whole(picture), 1.0)[:12, :, 3].any()


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_split_shows_the_picture_left_of_a_line(share: float) -> None:
    from blender_addon.pictures.view_paint import split, whole

    painted, column = split(whole(PICTURE), share), round(40 * share)
    assert laid_over(painted, PICTURE[::-1, ..., :3])[:, :column] == pytest.approx(
        PICTURE[:, :column, :3], abs=0.025
    )  # black of 8 bits: a level of the paint
    assert not painted[:, column + 1 :, 3].any()
    if 0 < column < 40:
        assert (painted[:, column] == 1.0).all()
