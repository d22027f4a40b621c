# SPDX-License-Identifier: Apache-2.0
"""Light that the target gives itself, in a room of which it is the walls. Oracle: path tracing of whole pictures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.light_paths import LightPaths

ROOM = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="13"/></integrator>
<sensor type="perspective"><float name="fov" value="70"/>
<transform name="to_world"><lookat origin="0.9, -0.9, 0.3" target="-0.5, 0.6, -0.2" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film>
</sensor>
<bsdf type="principled" id="target_bsdf"/>
<shape type="cube" id="target"><boolean name="flip_normals" value="true"/><ref id="target_bsdf"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.3"/><rotate x="1" angle="180"/>
<translate z="0.95"/></transform><emitter type="area"><rgb name="radiance" value="8, 8, 8"/></emitter></shape>
<shape type="sphere"><float name="radius" value="0.3"/><transform name="to_world"><translate x="-0.4" y="0.5" z="-0.7"/>
</transform><bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.2, 0.2"/></bsdf></shape></scene>"""
START = {"base_color": (0.8, 0.7, 0.5), "roughness": 0.5, "metallic": 0.0}
PAINT = {
    "target_bsdf": {
        "name": "Paint",
        "distribution": "MULTI_GGX",
        "sockets": {"Base Color": {"value": [0.8, 0.7, 0.5]}, "Roughness": {"value": 0.5}},
    }
}


def room(folder: Path, light_paths: LightPaths | None = None) -> tuple[Any, Any]:
    path = folder / "room.xml"
    path.write_text(ROOM, "utf-8")
    renderer = load_renderer(
        path, "target", model="blender_principled", parameters=["base_color", "roughness", "metallic"],
        materials=PAINT, light_paths=light_paths or LightPaths(),
    )  # fmt: skip
    from mfo_backend.render.paths.recorded_scene import RecordedScene  # needs the variant that the renderer sets

    return renderer, RecordedScene(renderer, int(renderer.target_mask().sum()))


def traced(renderer: Any, x: Any, paths: Any) -> Any:
    """The mean of the target's pixels."""
    return renderer.image(x, seed=7, spp=2048).reshape(-1, 3)[paths.pixel[paths.interior]].mean(axis=0)


def recorded(scene: Any, x: Any, paths: Any) -> Any:
    return scene.pictures(paths, paths.pixel_groups(paths.interior))(x)[:, :, 0].mean(axis=0)


@pytest.mark.parametrize(
    ("values", "known", "grown"),
    [
        ({"base_color": (0.84, 0.72, 0.52)}, 0.1, 0.01),
        ({"base_color": (0.6, 0.6, 0.6)}, 0.5, 0.12),
        ({"metallic": 0.6}, 0.035, 0.035),
    ],
    ids=["lighter", "another colour", "more metallic"],
)
def test_walls_light_each_other_by_their_albedo(
    tmp_path: Path, values: dict[str, Any], known: float, grown: float
) -> None:
    """One recording shows materials it was not made for; with its own light as known it is off by more than `known`."""
    renderer, scene = room(tmp_path)
    paths = scene.record(renderer.start, grid=12, seed=3, near=True)
    x = renderer.table.pack({**START, **values})
    expected = traced(renderer, x, paths)
    held = recorded(scene, x, replace(paths, returned=None))
    assert np.abs(held / expected - 1.0).max() > known
    np.testing.assert_allclose(recorded(scene, x, paths), expected, rtol=grown)


def test_derivatives_are_those_of_the_picture(tmp_path: Path) -> None:
    renderer, scene = room(tmp_path)
    paths = scene.record(renderer.start, grid=4, seed=3, near=True)
    image = scene.evaluator(paths, paths.tile_groups())
    x = renderer.table.pack({**START, "metallic": 0.2})
    found = image(x)
    for k, step in enumerate(1e-3 * np.eye(len(x))):
        expected = (image(x + step)[:, :, 0].astype(float) - image(x - step)[:, :, 0]) / 2e-3
        np.testing.assert_allclose(found[:, :, 1 + k], expected, atol=2e-3 * np.abs(expected).max())


def test_a_convex_target_gives_itself_no_light(tmp_path: Path) -> None:
    from tests.render.scenes import AREA, FLOOR, write_scene

    lights = AREA + FLOOR.replace("0.8, 0.3, 0.2", "0, 0, 0")
    renderer = load_renderer(
        write_scene(tmp_path, lights, depth=5), "target", model="mitsuba_principled", parameters=["base_color"]
    )
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    needs = replace(scene.needs, sampled=True, depth=5)
    paths = scene.record(renderer.start, grid=4, seed=3, near=True, needs=needs)
    assert paths.returned.share.max() == 0.0
    assert paths.bytes == 48 * paths.lanes


@pytest.mark.parametrize("limits", [(1, 1), (4, 0), (0, 4), (4, 4)], ids=str)
def test_the_bounce_at_the_target_counts_towards_the_limits(tmp_path: Path, limits: tuple[int, int]) -> None:
    """Without that it is up to 90 % too bright."""
    renderer, scene = room(tmp_path, LightPaths(diffuse_bounces=limits[0], glossy_bounces=limits[1]))
    paths = scene.record(renderer.start, grid=12, seed=3, near=True)
    x = renderer.start
    np.testing.assert_allclose(recorded(scene, x, paths), traced(renderer, x, paths), rtol=0.005)


def test_no_pair_of_the_albedo_looks_from_below_a_face() -> None:
    """A bump on faces whose normals lean has no value there, and one such pair of 4096 ended a fit of a floor."""
    load_variant()
    import drjit as dr
    import mitsuba as mi

    from mfo_backend.render.paths.returned_light import _albedo_lanes

    lean = np.linspace(-0.5, 0.5, 100)
    faces = mi.Vector3f(np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)]))
    paths: Any = SimpleNamespace(lanes=100, held={"geometric_normal": faces})
    lanes, _ = _albedo_lanes(paths, ["geometric_normal"])
    wi, _, _, face, _ = lanes.arrays
    assert np.min(dr.dot(wi, face)) >= -1e-6
    np.testing.assert_allclose(dr.norm(wi), 1.0, rtol=1e-5)
