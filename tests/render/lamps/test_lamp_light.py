# SPDX-License-Identifier: Apache-2.0
"""Light and densities of single lamps. Oracles: closed forms, and means over uniform directions. Cycles itself is the
oracle in tests/export/lights/test_lamps.py."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant
from tests.render.scenes import LAMPS

HIGH = 2.0  # metres from the lamp to the origin, whose normal points to it
COUNT = 1 << 22
MET = sorted(set(LAMPS) - {"sharp spot", "beam"})


@pytest.fixture(scope="module")
def mi():
    load_variant()
    import mitsuba

    from mfo_backend.render.lamps import lamp_plugins

    lamp_plugins.register()
    return mitsuba


def lamp(mi, kind, **properties):
    down = mi.ScalarTransform4f().look_at(origin=[0, 0, HIGH], target=[0, 0, 0], up=[0, 1, 0])
    radiance = {"type": "rgb", "value": [1.0, 1.0, 1.0]}
    return mi.load_dict({"type": kind, "to_world": down, "radiance": radiance, **properties})


def from_xml(mi, name):
    scene = mi.load_string(f'<scene version="3.0.0">{LAMPS[name]}</scene>', parallel=False, optimize=False)
    return scene.emitters()[0]


def at(mi, x, y, z):
    it = mi.Interaction3f()
    it.p = mi.Point3f(x, y, z)
    return it


def irradiance(mi, emitter, it, normal=(0.0, 0.0, 1.0)):
    """Mean of light samples at `it`."""
    import drjit as dr

    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, COUNT)
    ds, value = emitter.sample_direction(it, sampler.next_2d())
    cosine = dr.maximum(dr.dot(ds.d, mi.Vector3f(*normal)), 0)
    return float(dr.mean(value.x * cosine)[0])


@pytest.mark.parametrize(
    ("kind", "properties", "expected"),
    [
        # a disk that faces the point, a sphere: pi L sin^2 of the half angle it is seen under
        ("blender_point", {"radius": 0.8}, math.pi * 0.64 / (HIGH**2 + 0.64)),
        ("blender_point", {"radius": 0.8, "soft_falloff": False}, math.pi * 0.64 / HIGH**2),
        # the axis of a spot has all of its light
        ("blender_spot", {"radius": 0.1, "cone": 60.0, "blend": 0.5}, math.pi * 0.01 / (HIGH**2 + 0.01)),
        # a light of 20 m 2 m away, at angles a to the axis: 2 pi times the integral of (T - tan a)/(T - h) cos a sin a
        ("blender_area", {"size": 10.0, "spread": 90.0}, math.pi),
        ("blender_area", {"size": 10.0, "spread": 20.0, "round": True}, math.pi),
        ("blender_area", {"size": 10.0, "spread": 2.0}, math.pi),
        ("blender_area", {"size": 10.0, "spread": 0.0}, math.pi),
        ("blender_area", {"size": 0.5, "round": True}, math.pi * 0.25 / (HIGH**2 + 0.25)),
        ("blender_sun", {"angle": 60.0}, math.pi * 0.25),
        ("blender_sun", {"angle": 0.53}, math.pi * math.sin(math.radians(0.265)) ** 2),
    ],
)
def test_irradiance_is_the_closed_form(mi, kind, properties, expected):
    size = properties.pop("size", None)
    if size is not None:
        down = mi.ScalarTransform4f().look_at(origin=[0, 0, HIGH], target=[0, 0, 0], up=[0, 1, 0])
        properties["to_world"] = down @ mi.ScalarTransform4f().scale(size)
    emitter = lamp(mi, kind, **properties)
    assert irradiance(mi, emitter, at(mi, 0, 0, 0)) == pytest.approx(expected, rel=3e-3)  # four million samples


@pytest.mark.parametrize(("cosine", "expected"), [(0.925, 0.15625), (0.95, 0.5), (0.9, 0.0), (1.0, 1.0)])
def test_a_sharp_spot_fades_by_smoothstep_of_the_cosine(mi, cosine, expected):
    """The rim is at cosine 0.9 and the blend reaches the axis: a quarter of the way 3/16 - 2/64, half way one half."""
    down = mi.ScalarTransform4f().look_at(origin=[0, 0, HIGH], target=[0, 0, 0], up=[0, 1, 0])
    emitter = mi.load_dict(
        {
            "type": "blender_sharp_spot",
            "to_world": down,
            "intensity": {"type": "rgb", "value": [8.0, 4.0, 2.0]},
            "cone": 2.0 * math.degrees(math.acos(0.9)),
            "blend": 1.0,
        }
    )
    aside = HIGH * math.sqrt(1 - cosine**2) / cosine
    _, value = emitter.sample_direction(at(mi, aside, 0, 0), mi.Point2f(0.5))
    square = HIGH**2 + aside**2
    np.testing.assert_allclose(np.array(value).ravel() * square, np.array([8, 4, 2]) * expected, atol=2e-3)


# on the axis, aside, below the floor behind the lamp, and inside a sphere
PLACES = {"near": (0.2, -0.3, 0.1), "aside": (1.5, 0.8, 0.3), "close": (1.4, -1.8, 2.3)}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", MET)
def test_samples_take_their_density_and_carry_the_light_that_rays_meet(mi, name, place):
    import drjit as dr

    emitter, it = from_xml(mi, name), at(mi, *PLACES[place])
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(2, COUNT)
    # uniform directions of the cone that holds the lamp, or of all
    ds = dr.zeros(mi.DirectionSample3f, COUNT)
    ds.d = mi.warp.square_to_uniform_sphere(sampler.next_2d())
    ds.dist = mi.Float(dr.inf)
    density, met = emitter.pdf_direction(it, ds), emitter.eval_direction(it, ds)
    sampled, value = emitter.sample_direction(it, sampler.next_2d())
    np.testing.assert_allclose(emitter.pdf_direction(it, sampled), sampled.pdf, rtol=1e-3, atol=1e-4)
    # of every direction that can be sampled the density is that of the lamp's share of them
    share = float(dr.mean(dr.select(sampled.pdf > 0, 1.0, 0.0))[0])
    assert 4 * math.pi * float(dr.mean(density)[0]) == pytest.approx(share, rel=0.02, abs=1e-3)
    by_rays = 4 * math.pi * np.array(dr.mean(met, axis=1)).ravel()
    by_samples = np.array(dr.mean(value, axis=1)).ravel()
    np.testing.assert_allclose(by_samples, by_rays, rtol=0.02, atol=1e-3)
    if place != "aside":
        assert by_samples[0] > 0.0


def test_a_ray_meets_no_lamp_behind_a_surface(mi):
    import drjit as dr

    emitter = lamp(mi, "blender_area", spread=120.0)
    ds = dr.zeros(mi.DirectionSample3f)
    ds.d = mi.Vector3f(0, 0, 1)
    for distance, seen in ((HIGH + 0.01, True), (HIGH - 0.01, False)):
        ds.dist = mi.Float(distance)
        assert (float(emitter.eval_direction(at(mi, 0, 0, 0), ds).x[0]) > 0) == seen
    ds.d, ds.dist = mi.Vector3f(0, 0, -1), mi.Float(dr.inf)
    assert float(emitter.eval_direction(at(mi, 0, 0, 4), ds).x[0]) == 0.0  # its back is dark
