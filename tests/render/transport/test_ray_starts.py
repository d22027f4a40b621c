# SPDX-License-Identifier: Apache-2.0
"""Rays that leave surfaces: they meet what is near, not what they leave, and scenes look alike whatever their size."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

VARIANT, COUNT = load_variant(), 100_000
CYCLES = {"integrator": {"type": "cycles_path"}}


@pytest.fixture(autouse=True)
def _variant() -> None:
    if mi.variant() != VARIANT:
        mi.set_variant(VARIANT)


def loaded(**parts: Any) -> Any:
    """A scene, perhaps one whose pictures are as Cycles makes them."""
    from mfo_backend.render.transport import cycles_path

    cycles_path.register()
    return mi.load_dict({"type": "scene", **parts})


def placed(kind: str, at: list[float], size: float) -> dict[str, Any]:
    """A turned shape of Mitsuba's."""
    turned = mi.ScalarTransform4f().translate(at) @ mi.ScalarTransform4f().scale(size)
    return {"type": kind, "to_world": turned @ mi.ScalarTransform4f().rotate([0.0, 0.6, 0.8], 40.0)}


@pytest.mark.parametrize(("size", "away"), [(1e-4, 0.0), (1e-3, 0.0), (1.0, 0.0), (1e3, 0.0), (0.1, 0.7), (1.0, 9.0)])
@pytest.mark.parametrize("kind", ["sphere", "cube", "rectangle"])
@pytest.mark.parametrize("integrator", [{}, CYCLES], ids=["of Mitsuba", "of Cycles"])
def test_rays_do_not_meet_what_they_leave(integrator: dict[str, Any], kind: str, size: float, away: float) -> None:
    from mfo_backend.render.transport.ray_starts import RayStarts

    clear = {"bsdf": {"type": "null"}} if integrator else {}  # where rays start nearer
    scene = loaded(**integrator, shape=placed(kind, [away, away, 0.1 * away], size) | clear)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, COUNT)
    there = scene.shapes()[0].sample_position(0.0, sampler.next_2d())
    above = mi.Point3f(there.p + mi.Vector3f(there.n) * size)
    si = scene.ray_intersect(mi.Ray3f(above, dr.normalize(there.p - above)))
    assert np.array(si.is_valid()).sum() > 0.99 * COUNT
    out = mi.Frame3f(si.n).to_world(mi.warp.square_to_uniform_hemisphere(sampler.next_2d()))
    starts = RayStarts(scene)
    most = 10 if size > 100.0 else 0  # a kilometre is coarse in float32: a ray in ten thousand may
    assert np.sum(scene.ray_test(starts.ray(si, out), si.is_valid())) <= most
    assert np.sum(scene.ray_test(starts.ray_to(si, si.p + out * size), si.is_valid())) <= most


@pytest.mark.parametrize("size", [1e-4, 1.0])
def test_rays_meet_what_is_near(size: float) -> None:
    """A second sheet a fiftieth of the first one's size above it; Mitsuba's rays start above the small one."""
    from mfo_backend.render.transport.ray_starts import RayStarts

    gap = 0.02 * size
    sheets = {f"sheet_{k}": placed("rectangle", [0.0, 0.0, k * gap], size) for k in range(2)}
    scene = mi.load_dict({"type": "scene", **sheets})
    up = mi.Vector3f(0.0, 0.0, 1.0)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.1 * size, 0.1 * size, -size), up))
    ray = RayStarts(scene).ray(si, up)
    np.testing.assert_allclose(np.array(scene.ray_intersect(ray).t), gap, rtol=0.1)
    assert np.all(scene.ray_test(RayStarts(scene).ray_to(si, si.p + 2.0 * gap * up)))


def small_world(size: float) -> Any:
    """A ball above a floor under a lamp and a sky, all of it by a factor."""
    from mfo_backend.render.transport import cycles_path

    cycles_path.register()
    sensor = {
        "type": "perspective", "fov": 40.0, "near_clip": 0.01 * size, "far_clip": 100.0 * size,
        "to_world": mi.ScalarTransform4f().look_at([0, -4 * size, size], [0, 0, 0], [0, 0, 1]),
        "film": {"type": "hdrfilm", "width": 24, "height": 24, "rfilter": {"type": "box"}},
    }  # fmt: skip
    lamp = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([size, -size, 3 * size]).rotate([1, 0, 0], 180.0).scale(size),
        "emitter": {"type": "area", "radiance": 4.0},
    }
    grey = {"type": "diffuse", "reflectance": 0.8}
    down = mi.ScalarTransform4f().translate([0, 0, -size]).scale(4 * size)
    return mi.load_dict({
        "type": "scene", "integrator": {"type": "cycles_path", "max_depth": 5}, "sensor": sensor, "lamp": lamp,
        "sky": {"type": "constant", "radiance": 0.5}, "floor": {"type": "rectangle", "to_world": down, "bsdf": grey},
        "ball": {"type": "sphere", "radius": size, "bsdf": grey},
    })  # fmt: skip


def test_a_scene_of_a_millimetre_is_traced_as_one_of_a_metre() -> None:
    large, small = (np.array(mi.render(small_world(size), seed=mi.UInt32(3), spp=64)) for size in (1.0, 1e-3))
    # the same random numbers: few paths part. Mitsuba's starts make the small one 2 % darker
    assert abs(small.mean() / large.mean() - 1.0) < 5e-4


def test_a_scene_of_a_millimetre_is_recorded_as_one_of_a_metre() -> None:
    from mfo_backend.render.paths.record_paths import record_paths
    from mfo_backend.render.paths.record_settings import RecordSettings

    light = []
    for size in (1.0, 1e-3):
        scene = small_world(size)
        ball = next(shape for shape in scene.shapes() if "Sphere" in shape.class_name())
        light.append(np.array(record_paths(scene, ball, RecordSettings(grid=4, seed=3, depth=5)).weight).sum())
    assert abs(light[1] / light[0] - 1.0) < 5e-4


@pytest.mark.parametrize(("gap", "away"), [(2e-5, 0.0), (5e-5, 6.0), (5e-4, 60.0)])
def test_rays_meet_what_a_decal_lies_on(gap: float, away: float) -> None:
    """As floats allow; at 6 m from zero Mitsuba's rays start 0.6 mm behind what they pass."""
    from mfo_backend.render.transport.ray_starts import RayStarts

    heights = {"decal": gap, "wall": 0.0}
    sheets = {
        name: {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([away, 0.0, height]).scale(3.0),
            "bsdf": {"type": "null" if height else "diffuse"},
        }
        for name, height in heights.items()
    }
    scene = loaded(**CYCLES, **sheets)
    down = mi.Vector3f(0.0, 0.6, -0.8)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(away + 0.3, 0.1, 2.0), down))
    behind = scene.ray_intersect(RayStarts(scene).ray(si, down))
    assert np.all(behind.is_valid())
    assert abs(np.array(behind.p)[2, 0]) < 0.1 * gap


def test_rays_to_a_light_meet_a_film_just_before_it() -> None:
    """Half a millimetre before it on a way of two metres, of which Mitsuba leaves out 1.8 mm."""
    from mfo_backend.render.transport.ray_starts import RayStarts

    film = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([0.0, 0.0, 2.0 - 5e-4]),
        "bsdf": {"type": "null"},
    }
    scene = loaded(**CYCLES, floor={"type": "rectangle"}, film=film)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.1, 0.2, 1.0), mi.Vector3f(0.0, 0.0, -1.0)))
    assert np.all(scene.ray_test(RayStarts(scene).ray_to(si, mi.Point3f(0.1, 0.2, 2.0))))
