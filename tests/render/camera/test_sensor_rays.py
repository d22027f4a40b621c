# SPDX-License-Identifier: Apache-2.0
"""Rays of a camera without sizes in their kernels. Oracle: Mitsuba's own."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

load_variant()

import mitsuba as mi  # noqa: E402  after the variant is set

from mfo_backend.render.camera.sensor_rays import film_samples, sensor_ray  # noqa: E402

FILM = {"type": "hdrfilm", "width": 40, "height": 30, "filter": {"type": "gaussian"}}
CROP = {"crop_width": 20, "crop_height": 10, "crop_offset_x": 3, "crop_offset_y": 7}
PLACE = {"to_world": mi.ScalarTransform4f().look_at([1, 2, 3], [0, 0.3, 0], [0, 0, 1])}
CLIP = {"near_clip": 0.3, "far_clip": 30.0}
SHIFT = {"principal_point_offset_x": 0.13, "principal_point_offset_y": -0.07}
SENSORS = {
    "perspective": {"type": "perspective", "fov": 40.0, **CLIP},
    "shifted": {"type": "perspective", "fov": 40.0, "fov_axis": "y", **SHIFT, **CLIP},
    "in time": {"type": "perspective", "fov": 40.0, "shutter_open": 0.0, "shutter_close": 1.0},
    "lens": {"type": "thinlens", "fov": 40.0, "aperture_radius": 0.1, "focus_distance": 3.0},
    "orthographic": {"type": "orthographic"},
}


def loaded(name, **film):
    return mi.load_dict({**SENSORS[name], **PLACE, "film": {**FILM, **film}})


@pytest.mark.parametrize("film", [{}, CROP], ids=["whole", "part"])
@pytest.mark.parametrize("name", SENSORS)
def test_rays_are_those_of_the_sensor(name, film):
    sensor = loaded(name, **film)
    x, y, u, v = np.random.default_rng(3).random((4, 200))
    places = mi.Point2f(x, y), mi.Point2f(u, v)
    ray = sensor_ray(sensor, *places)
    expected, _ = sensor.sample_ray(0.5 * sensor.shutter_open_time(), 0.5, *places)
    for attribute in ("o", "d", "time", "maxt"):
        np.testing.assert_allclose(getattr(ray, attribute), getattr(expected, attribute), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "film", "samples", "rfilter"),
    [
        ("shifted", {}, 3, "box"),
        ("shifted", {**CROP, "sample_border": True}, 4, "gaussian"),
        ("lens", {**CROP, "sample_border": True}, 3, "box"),
    ],
    ids=["whole", "part with a border", "lens"],
)
def test_samples_are_those_of_an_integrator(name, film, samples, rfilter):
    sensor = loaded(name, **film, filter={"type": rfilter})
    integrator = mi.load_dict({"type": "prb"})

    def sampler():
        return integrator.prepare(sensor, 5, samples, [])[0]

    ray, place = film_samples(sensor, sampler())
    expected, _, expected_place = integrator.sample_rays(None, sensor, sampler())
    np.testing.assert_allclose(place, mi.Point2f(expected_place), atol=1e-5)
    np.testing.assert_allclose(ray.d, expected.d, atol=1e-5)
    np.testing.assert_allclose(ray.o, expected.o, atol=1e-5)


@pytest.mark.parametrize("name", SENSORS)
def test_no_size_is_part_of_a_kernel(name):
    def kernels(width, height, samples):
        sensor = loaded(name, width=2 * width, height=height, crop_width=width, crop_offset_x=width // 2)
        sampler = mi.load_dict({"type": "independent", "sample_count": samples})
        sampler.seed(dr.opaque(mi.UInt32, 1), width * height * samples)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            ray, place = film_samples(sensor, sampler)
            dr.eval(ray.o, ray.d, place)
            return {k["hash"] for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT}

    assert kernels(12, 8, 2) == kernels(20, 30, 3) != set()
