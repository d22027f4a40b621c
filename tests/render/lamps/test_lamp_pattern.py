# SPDX-License-Identifier: Apache-2.0
"""The backend looks a lamp's tables up where the add-on's layout puts them. Oracle: the layout's own directions."""

from __future__ import annotations

import numpy as np
import pytest

from blender_addon.bake.lamp_layout import FAR, NEAR, STEPS, directions, distances, places
from mfo_backend.render.machine.variant import load_variant

FRAME = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]) @ np.diag([0.5, 1.5, -1.0])
SIDE = 64


@pytest.fixture(scope="module")
def mi():
    load_variant()
    import mitsuba

    return mitsuba


def pattern(mi, **properties):
    """Tables without a lamp, as a lamp reads them from a scene."""
    from mfo_backend.render.lamps.lamp_pattern import LampPattern

    props = mi.Properties("pattern")
    for name, value in properties.items():
        if isinstance(value, np.ndarray):
            data = mi.TensorXf(np.ascontiguousarray(value, np.float32))
            value = mi.load_dict({"type": "bitmap", "data": data, "raw": True, "wrap_mode": "clamp"})
        props[name] = value
    return LampPattern(props, FRAME)


def vectors(mi, values):
    return mi.Vector3f(*np.ascontiguousarray(values.T, np.float32))


def asked(table, mi, away, distance=1.0, place=None):
    return np.array(table.of(mi.Color3f(1.0), mi.Float(distance), vectors(mi, away), place)).T


@pytest.mark.parametrize(("rim", "halves"), [(90.0, 2), (90.0, 1), (60.0, 1), (5.0, 1)])
def test_directions_are_found_again(mi, rim, halves):
    local = np.random.default_rng(1).normal(size=(4000, 3))
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    if halves == 1:
        # evenly within the cone, not at its very rim, where the table has the directions a little inside
        height = 1.0 - (1.0 - np.cos(np.radians(rim * 0.97))) * np.linspace(0.0, 1.0, len(local))
        local[:, :2] *= (np.sqrt(1.0 - height**2) / np.linalg.norm(local[:, :2], axis=1))[:, None]
        local[:, 2] = height
    told = directions(SIDE, rim, halves)
    table = pattern(
        mi, pattern=(0.5 + 0.5 * told).reshape(SIDE, halves * SIDE, 3), pattern_rim=rim, pattern_halves=halves
    )
    found = asked(table, mi, 7.0 * local @ FRAME.T)
    # the curve of a disc between pixels; a pixel at the middle is 0.03 of the radius
    np.testing.assert_allclose(2.0 * found - 1.0, local, atol=1.5e-3)


def test_a_turned_table_has_the_directions_of_the_turned_lamp(mi):
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    told = (0.5 + 0.5 * directions(SIDE, 90.0, 2)).reshape(SIDE, 2 * SIDE, 3)
    table = pattern(mi, pattern=told, pattern_halves=2)
    away = np.random.default_rng(2).normal(size=(100, 3))
    np.testing.assert_allclose(asked(table.turned(turn), mi, away @ turn.T), asked(table, mi, away), atol=1e-4)
    assert np.abs(asked(table, mi, away @ turn.T) - asked(table, mi, away)).max() > 0.5


def test_a_pixel_of_a_disc_has_the_same_solid_angle_everywhere():
    told = directions(256, 90.0, 2)[:, 2].reshape(256, 512)
    front = told[:, :256]
    # the cap within a polar angle holds 1 - cos of it
    for height in (0.9, 0.5, 0.1):
        assert (front > height).sum() / (front > 0.0).sum() == pytest.approx(1.0 - height, abs=2e-3)
    np.testing.assert_allclose(np.linalg.norm(directions(32, 40.0, 1), axis=1), 1.0)


def test_places_are_found_again(mi):
    told = places(SIDE)[:, :2]
    colors = np.concatenate([told, np.zeros((len(told), 1))], axis=1).reshape(SIDE, SIDE, 3)
    table = pattern(mi, pattern=colors, pattern_by="place")
    x, y = np.random.default_rng(3).uniform(-0.96, 0.96, (2, 500))
    found = asked(table, mi, np.tile([0.0, 0.0, 1.0], (500, 1)), 1.0, (mi.Float(x), mi.Float(y)))
    np.testing.assert_allclose(found[:, :2], np.stack([x, y], axis=1), atol=2e-3)


def test_falloffs_are_found_again(mi):
    steps = distances()
    assert (steps[0], steps[-1], len(steps)) == (pytest.approx(NEAR), pytest.approx(FAR), STEPS)
    table = pattern(mi, falloff=np.repeat((steps**2)[None, :, None], 3, axis=2))
    for metres in (0.0123, 0.9, 3.3, 77.0, 612.0):
        found = asked(table, mi, np.array([[0.0, 0.0, 1.0]]), metres)
        np.testing.assert_allclose(found, metres**2, rtol=5e-4)
    # no further than to the ends
    assert asked(table, mi, np.array([[0.0, 0.0, 1.0]]), 10.0 * FAR)[0, 0] == pytest.approx(FAR**2, rel=1e-3)
