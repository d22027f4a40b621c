# SPDX-License-Identifier: Apache-2.0
"""Lamps in whole pictures and in recorded paths. Oracles: each other, and light samples alone in Mitsuba's `path`."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import FLOOR, LAMPS, POINT, SKY, write_scene

# half metal, so that light samples and rays of the material both matter
GLAZE = {"Base Color": {"value": [0.9, 0.6, 0.4]}, "Metallic": {"value": 0.5}, "Roughness": {"value": 0.45}}
GLASS = {"Transmission Weight": {"value": 1.0}, "Roughness": {"value": 0.4}, "IOR": {"value": 1.45}}
SEEN = '<boolean name="camera" value="true"/></emitter>'


def load(folder, lights, sockets=GLAZE, *, model="blender_principled", **options):
    material = {"name": "Ball", "distribution": "MULTI_GGX", "sockets": sockets}
    path = write_scene(folder, lights, size=16, **options)
    return load_renderer(
        path, "target", model=model, parameters=["base_color", "roughness"], materials={"target_bsdf": material}
    )


def recorded(renderer, vector, grid=24):
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = scene.record(vector, grid=grid, seed=3, near=False)
    groups = paths.tile_groups()
    return groups, scene.evaluator(paths, groups)(vector)[:, :, 0]


@pytest.mark.parametrize("name", LAMPS)
def test_the_integrator_has_the_light_of_mitsubas_path(tmp_path, name):
    """Which takes light samples alone, as lamps are no shapes: noisy for a shiny material, but true."""
    import mitsuba as mi

    renderer = load(tmp_path, LAMPS[name])
    means = [renderer.image(renderer.start, seed=s, spp=1024).mean(axis=(0, 1)) for s in range(4)]
    plain = mi.load_dict({"type": "path", "max_depth": 2})
    others = [np.array(mi.render(renderer.scene, integrator=plain, seed=s, spp=1024)).mean((0, 1)) for s in range(4)]
    noise = np.sqrt(np.var(means, axis=0) + np.var(others, axis=0)) / 2.0
    difference = np.abs(np.mean(means, axis=0) - np.mean(others, axis=0))
    assert np.all(difference < 4 * noise + 1e-4 * np.mean(means))
    assert np.all(noise < 0.005 * np.mean(means))


@pytest.mark.parametrize("name", LAMPS)
def test_recorded_paths_hold_the_light_of_the_picture(tmp_path, name):
    renderer = load(tmp_path, LAMPS[name])
    x = renderer.table.pack({"base_color": (0.8, 0.5, 0.3), "roughness": 0.4})
    groups, got = recorded(renderer, x)
    expected = groups.average(renderer.image(x, seed=7, spp=1024))
    np.testing.assert_allclose(got.sum(axis=0), expected.sum(axis=0), rtol=0.01)
    assert np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2)) < 0.03  # noise of both in a tile


@pytest.mark.parametrize("depth", [2, 5])
def test_recorded_paths_hold_several_lamps_beside_other_lights(tmp_path, depth):
    lights = LAMPS["soft point"] + LAMPS["sun"] + LAMPS["spread"] + LAMPS["sharp spot"] + POINT + SKY + FLOOR
    renderer = load(tmp_path, lights, depth=depth)
    groups, got = recorded(renderer, renderer.start)
    expected = groups.average(renderer.image(renderer.start, seed=7, spp=1024))
    np.testing.assert_allclose(got.sum(axis=0), expected.sum(axis=0), rtol=0.01)


@pytest.mark.parametrize("camera", [True, False])
def test_a_lamp_before_the_target_is_seen_or_not(tmp_path, camera):
    """Between camera and ball: a small disk."""
    small = """<emitter type="blender_point"><transform name="to_world"><translate y="-2" z="0.5"/></transform>
<rgb name="radiance" value="9, 9, 9"/><float name="radius" value="0.2"/></emitter>"""
    renderer = load(tmp_path, small.replace("</emitter>", SEEN) if camera else small)
    picture = renderer.image(renderer.start, seed=7, spp=1024)
    assert (picture.max() > 8.0) == camera
    groups, got = recorded(renderer, renderer.start)
    np.testing.assert_allclose(got.sum(axis=0), groups.average(picture).sum(axis=0), rtol=0.01)


@pytest.mark.parametrize("camera", [True, False])
def test_paths_through_glass_meet_lamps(tmp_path, camera):
    behind = """<emitter type="blender_area"><transform name="to_world"><scale value="0.7"/><lookat origin="0.3, 3, 0"
target="0, 0, 0" up="0, 0, 1"/></transform><rgb name="radiance" value="3, 4, 5"/></emitter>"""
    lights = behind.replace("</emitter>", SEEN) if camera else behind
    renderer = load(tmp_path, lights + LAMPS["sphere"], GLASS, depth=6)
    from mfo_backend.render.traced.traced_paths import TracedPaths

    pixels = np.flatnonzero(renderer.target_mask().ravel())
    x = renderer.table.pack({"base_color": (0.9, 0.8, 0.7), "roughness": 0.3})
    got = TracedPaths(renderer).images(x[None], pixels, seed=1, samples=2048, jacobian=False)[0, :, :, 0]
    expected = renderer.image(x, seed=7, spp=2048).reshape(-1, 3)[pixels]
    np.testing.assert_allclose(got.mean(axis=0), expected.mean(axis=0), rtol=0.015)


def test_scenes_with_lamps_take_the_integrator_that_knows_them(tmp_path):
    for model in ("blender_principled", "mitsuba_principled"):
        assert load(tmp_path, LAMPS["round"], model=model).light_paths == LightPaths()
        assert load(tmp_path, POINT, model=model).light_paths is None
