# SPDX-License-Identifier: Apache-2.0
"""Rays are computed where they are asked for: whatever part of them is asked for, they are the same ones."""

from __future__ import annotations

import numpy as np
import pytest

RADIUS = 0.3
SENSORS = {
    "pinhole": {"type": "perspective"},
    "lens": {"type": "thinlens", "aperture_radius": RADIUS, "focus_distance": 4.0},
}


def rays(sensor="pinhole", rfilter="box", four=False, seed=3):
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    import mitsuba as mi

    from mfo_backend.render.camera.pixel_cells import PixelCells
    from mfo_backend.render.camera.primary_rays import PrimaryRays, tile_order

    film = {"type": "hdrfilm", "width": 12, "height": 8, "filter": {"type": rfilter}}
    order, tile = tile_order(12, 8)
    per_axis = np.arange(len(order)) % 4 + 1
    loaded = mi.load_dict({**SENSORS[sensor], "film": film, "fov": 40.0})
    return mi, PrimaryRays(loaded, PixelCells.grid(per_axis), order, tile, seed, four=four), per_axis


@pytest.mark.parametrize("stride", [1, 2, 3, 9])
@pytest.mark.parametrize(("width", "height"), [(12, 8), (13, 7), (1, 1), (50, 33)])
def test_pixels_are_ordered_by_tile_and_its_quarters(width, height, stride):
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    from mfo_backend.render.camera.primary_rays import TILE, quarter, tile_order

    row, column = np.divmod(np.arange(width * height), width)
    across, down = column // TILE, row // TILE
    kept = np.flatnonzero((down % stride == stride // 2) & (across % stride == stride // 2))
    number = (down * -(-width // TILE) + across)[kept]
    expected = kept[np.lexsort((kept, quarter(kept, width), number))]
    order, tile = tile_order(width, height, stride)
    np.testing.assert_array_equal(order, expected)
    np.testing.assert_array_equal(tile, np.sort(number))


def test_pixels_of_a_part_of_the_film_are_those_of_the_whole_film():
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    import mitsuba as mi

    from mfo_backend.render.camera.primary_rays import camera_ray

    def directions(pixels, **crop):
        film = {"type": "hdrfilm", "width": 12, "height": 8, **crop}
        sensor = mi.load_dict({"type": "perspective", "film": film, "fov": 40.0, "principal_point_offset_x": 0.1})
        ray = camera_ray(sensor, mi.UInt32(pixels), mi.Point2f(0.1, -0.2), mi.Point2f(0.5))
        return np.array(ray.d)

    part = directions(np.arange(15), crop_offset_x=4, crop_offset_y=2, crop_width=5, crop_height=3)
    rows, columns = np.divmod(np.arange(15), 5)
    np.testing.assert_allclose(part, directions((rows + 2) * 12 + columns + 4), atol=1e-6)


@pytest.mark.parametrize("four", [False, True])
@pytest.mark.parametrize("rfilter", ["box", "gaussian", "lanczos"])
@pytest.mark.parametrize("sensor", SENSORS)
def test_some_of_the_rays_are_those_of_all(sensor, rfilter, four):
    mi, made, per_axis = rays(sensor, rfilter, four)
    assert len(made) == (4 if four else 1) * np.square(per_axis).sum()
    every, some = np.arange(len(made)), np.array([5, 17, 17, 200, len(made) - 1])

    def of(number):
        number = mi.UInt32(number)
        ray = made.ray(number)
        return [np.array(a) for a in (ray.o, ray.d, made.position(number), made.weight(number))]

    for all_of_them, few in zip(of(every), of(some), strict=True):
        picked = all_of_them[..., some] if all_of_them.shape[-1] == len(made) else all_of_them
        np.testing.assert_allclose(few, picked, rtol=1e-6, atol=1e-6)  # float32 in two kernels


@pytest.mark.parametrize("rfilter", ["box", "gaussian", "lanczos"])
def test_weights_of_a_pixel_add_up_to_one(rfilter):
    mi, made, per_axis = rays(rfilter=rfilter, four=True)
    number = mi.UInt32(np.arange(len(made)))
    total = np.bincount(np.array(made.position(number)), np.array(made.weight(number)), len(per_axis))
    np.testing.assert_allclose(total, 1.0, atol=1e-5)
    assert (np.array(made.weight(number)) < 0.0).any() == (rfilter == "lanczos")


def test_rays_begin_all_over_a_lens_and_a_pinhole_has_one_point():
    mi, made, _ = rays("lens")
    number = mi.UInt32(np.arange(len(made)))
    away = np.hypot(*np.array(made.ray(number).o)[:2])
    assert away.max() < RADIUS * 1.01
    np.testing.assert_allclose(np.mean(away**2), RADIUS**2 / 2, rtol=0.15)  # uniform over the disc; 720 points
    other = rays("lens", seed=4)[1]
    assert np.abs(np.array(other.ray(number).o) - np.array(made.ray(number).o)).max() > 0.1
