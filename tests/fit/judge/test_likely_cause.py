# SPDX-License-Identifier: Apache-2.0
"""Where two pictures differ says why; here on a disc whose difference is put where a cause would have it."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.judge.likely_cause import RIM, likely_cause
from mfo_backend.types.verdict import Cause

SIZE = 64
Y, X = np.mgrid[:SIZE, :SIZE]


def disc(radius, x=31.5, y=31.5):
    return np.hypot(X - x, Y - y) < radius


def textured(mask, seed=1):
    """A disc that no shift makes another, on black."""
    noise = np.random.default_rng(seed).uniform(0.2, 0.8, (SIZE, SIZE, 3))
    return np.where(mask[..., None], noise, 0.0)


@pytest.mark.parametrize("radius", [20, 12])
def test_a_difference_at_the_silhouette_is_the_shapes(radius):
    mask = disc(radius)
    reference, result = textured(mask), textured(mask)
    result[mask & ~disc(radius - RIM)] += 0.3
    assert likely_cause(reference, result, mask, None, noted=True) is Cause.CAMERA_OR_SHAPE


@pytest.mark.parametrize("noted", [False, True])
def test_a_difference_everywhere_is_not_the_shapes_where_most_of_a_small_target_is_rim(noted):
    mask = disc(5)
    reference, result = textured(mask), textured(mask)
    result[mask] += 0.3
    cause = Cause.NOTED if noted else Cause.MATERIAL
    assert likely_cause(reference, result, mask, None, noted=noted) is cause


def test_a_difference_inside_is_the_materials():
    mask = disc(20)
    reference, result = textured(mask), textured(mask)
    result[disc(10)] += 0.3
    assert likely_cause(reference, result, mask, None, noted=False) is Cause.MATERIAL


@pytest.mark.parametrize("step", [1, 4])
def test_a_moved_picture_is_the_cameras(step):
    whole = textured(np.ones((SIZE, SIZE), bool))
    smooth = sum(np.roll(whole, (i, j), (0, 1)) for i in range(5) for j in range(5)) / 25
    assert likely_cause(smooth, np.roll(smooth, step, 1), disc(20), None, noted=False) is Cause.CAMERA_OR_SHAPE


def lit(mask, level=0.6, floor=0.3, turn=0.0):
    """A disc on a floor that is lit from one side; `turn` turns the light."""
    slope = (X * np.cos(turn) + Y * np.sin(turn)) / SIZE - 0.5 * (np.cos(turn) + np.sin(turn))
    return np.repeat(np.where(mask, level, floor + 0.1 * slope)[..., None], 3, axis=2)


def surroundings(reference, result, mask):
    """Both pictures and what is beside the disc, pixels being blocks."""
    return reference, result, ~mask


def cause_of(reference, result, mask):
    around = surroundings(reference, result, mask)
    return likely_cause(reference, result, mask, around, noted=False)


def test_another_object_before_the_same_floor_is_another_picture():
    mask = disc(14)
    ring = disc(30) & ~disc(22)
    assert cause_of(lit(ring), lit(mask), mask) is Cause.PICTURE


@pytest.mark.parametrize("contrast", [1.0, 0.25])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_what_hides_an_outline_is_no_other_picture(noise, contrast):
    """Fog takes contrast, few samples add noise, and a lamp from behind makes the object the darker one."""
    mask, draw = disc(14), np.random.default_rng(2)
    for level in (0.6, 0.02):
        foggy = 0.5 + contrast * (lit(mask, level, turn=2.0) - 0.3)
        assert cause_of(foggy + noise * draw.normal(size=foggy.shape), lit(mask), mask) is Cause.LIGHT


def test_what_stands_before_the_silhouette_is_in_the_surroundings():
    mask = disc(14)
    reference = lit(mask)
    reference[(np.hypot(X - 47, Y - 31.5) < 7)] = (0.8, 0.1, 0.1)
    assert cause_of(reference, lit(mask), mask) is Cause.SURROUNDINGS


def test_an_object_that_is_a_little_larger_is_the_shapes_where_the_surroundings_agree():
    mask = disc(14)
    assert likely_cause(lit(disc(13)), lit(mask), mask, None, noted=False) is Cause.CAMERA_OR_SHAPE
