# SPDX-License-Identifier: Apache-2.0
"""A target that glows, on recorded paths. Oracle: Mitsuba's own integrator."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from tests.render.scenes import POINT, write_scene

GLOW = '<emitter type="area"><rgb name="radiance" value="0.3, 0.2, 0.1"/></emitter>'
LAYERED_GLOW = GLOW.replace("area", "blender_glow").replace(
    "</emitter>", '<boolean name="layered" value="true"/></emitter>'
)


def test_the_targets_own_light_is_part_of_the_constant_picture(tmp_path):
    materials = {"target_bsdf": {"name": "Lamp", "distribution": "MULTI_GGX", "sockets": {}}}
    path = write_scene(tmp_path, POINT, shape=GLOW)
    names = ["base_color", "roughness"]
    renderer = load_renderer(path, "target", model="blender_principled", parameters=names, materials=materials)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack({"base_color": (0.7, 0.3, 0.1), "roughness": 0.4})
    paths = scene.record(x, grid=10, seed=3, near=False)
    groups = paths.tile_groups(paths.interior)
    got = scene.evaluator(paths, groups)(x)[:, :, 0]
    expected = groups.average(renderer.image(x, seed=7, spp=256))
    error = np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2))
    assert error < 0.02  # `path` picks one of two lights: 1.6 % in a tile of 4096 samples
    assert got.min() > 0.09  # nothing is darker than the glow


LAYERS = ["sheen_weight", "sheen_tint", "coat_weight", "coat_roughness", "coat_ior", "coat_tint", "emission_color"]


def glowing_scene(tmp_path, strength, names):
    sockets = {
        "Emission Color": {"value": [0.5, 0.4, 0.2], "linked": False},
        "Emission Strength": {"value": strength, "linked": False},
        "Coat Roughness": {"value": 0.3, "linked": False},
    }
    materials = {"target_bsdf": {"name": "Lamp", "distribution": "MULTI_GGX", "sockets": sockets, "film_exposure": 1.5}}
    path = write_scene(tmp_path, POINT, shape=LAYERED_GLOW)
    # of meshes, as exported targets are: from its own surface Mitsuba's sphere is sampled wrongly
    path.write_text(path.read_text("utf-8").replace('type="sphere"', 'type="cube"'), "utf-8")
    renderer = load_renderer(path, "target", model="blender_principled", parameters=names, materials=materials)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    return renderer, RecordedScene(renderer, int(renderer.target_mask().sum()))


@pytest.mark.parametrize("free", [LAYERS, LAYERS[:-1]], ids=["emission free", "emission held"])
def test_layers_dim_the_glow_in_picture_and_derivatives(tmp_path, free):
    renderer, scene = glowing_scene(tmp_path, 2.0, ["base_color", *free])
    table = renderer.table
    recorded_for = table.pack({"base_color": 0.2, "emission_color": 0.9} if "emission_color" in free else {})
    paths = scene.record(recorded_for, grid=10, seed=3, near=False)
    groups = paths.tile_groups(paths.interior)
    values = {
        "base_color": (0.2, 0.1, 0.1), "sheen_weight": 0.5, "sheen_tint": (0.9, 0.5, 0.2), "coat_weight": 0.7,
        "coat_roughness": 0.4, "coat_ior": 1.7, "coat_tint": (0.9, 0.7, 0.4), "emission_color": (0.5, 0.4, 0.2),
    }  # fmt: skip
    x = table.pack({name: value for name, value in values.items() if name in table.names})
    evaluate = scene.evaluator(paths, groups)
    got = evaluate(x)
    expected = groups.average(renderer.image(x, seed=7, spp=256))
    error = np.sqrt(np.mean((got[:, :, 0] - expected) ** 2) / np.mean(expected**2))
    assert error < 0.01
    assert got[:, :, 0].mean() < 0.9 * 2.0 * 1.5 * np.mean([0.5, 0.4, 0.2])  # most of it is the glow, which is dimmed
    step = 1e-3
    for k in range(table.length):
        beside = np.eye(table.length)[k] * step
        slope = (evaluate(x + beside)[:, :, 0] - evaluate(x - beside)[:, :, 0]) / (2 * step)
        np.testing.assert_allclose(got[:, :, 1 + k], slope, atol=2e-3 * max(np.abs(slope).max(), 1.0))


def test_free_emission_is_linear_in_picture_and_derivatives(tmp_path):
    sockets = {
        "Emission Color": {"value": [0.5, 0.4, 0.2], "linked": False},
        "Emission Strength": {"value": 0.8, "linked": False},
    }
    materials = {"target_bsdf": {"name": "Lamp", "distribution": "MULTI_GGX", "sockets": sockets, "film_exposure": 1.5}}
    path = write_scene(tmp_path, POINT, shape=GLOW)  # which the sockets know better
    # of meshes, as exported targets are: from its own surface Mitsuba's sphere is sampled wrongly
    path.write_text(path.read_text("utf-8").replace('type="sphere"', 'type="cube"'), "utf-8")
    names = ["base_color", "roughness", "emission_color"]
    renderer = load_renderer(path, "target", model="blender_principled", parameters=names, materials=materials)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    np.testing.assert_allclose(renderer.start[-3:], [0.5, 0.4, 0.2])
    recorded_for = renderer.table.pack({"base_color": (0.7, 0.3, 0.1), "roughness": 0.4, "emission_color": 0.9})
    paths = scene.record(recorded_for, grid=10, seed=3, near=False)
    groups = paths.tile_groups(paths.interior)
    x = renderer.table.pack({"base_color": (0.7, 0.3, 0.1), "roughness": 0.4, "emission_color": (0.1, 0.3, 0.6)})
    got = scene.evaluator(paths, groups)(x)
    expected = groups.average(renderer.image(x, seed=7, spp=256))
    error = np.sqrt(np.mean((got[:, :, 0] - expected) ** 2) / np.mean(expected**2))
    assert error < 0.02  # a cube does not light itself
    assert got[:, 2, 0].min() > 0.6 * 0.8 * 1.5 - 0.02
    np.testing.assert_allclose(got[:, :, -3:], 1.2 * np.broadcast_to(np.eye(3), (len(got), 3, 3)), atol=1e-4)
    np.testing.assert_allclose(scene.pictures(paths, groups)(x)[:, :, 0], got[:, :, 0], rtol=1e-4)


def test_a_free_strength_scales_what_a_texture_gives(tmp_path):
    """Oracle: Mitsuba's own area light of the same picture."""
    import mitsuba as mi

    from mfo_backend.render.pictures.mitsuba_renderer import two_threads

    colors = np.random.default_rng(4).random((4, 4, 3)).astype(np.float32)
    with two_threads():
        mi.Bitmap(colors).write(str(tmp_path / "glow.exr"))
    sockets = {
        "Base Color": {"value": [0.0, 0.0, 0.0], "linked": False},
        "Emission Color": {"value": [0.5, 0.5, 0.5], "linked": True, "texture": str(tmp_path / "glow.exr")},
        "Emission Strength": {"value": 0.8, "linked": False},
    }
    materials = {"target_bsdf": {"name": "Lamp", "distribution": "MULTI_GGX", "sockets": sockets, "film_exposure": 1.5}}
    path = write_scene(tmp_path, POINT, shape=GLOW)
    path.write_text(path.read_text("utf-8").replace('type="sphere"', 'type="cube"'), "utf-8")
    names = ["specular_ior_level", "emission_strength"]
    renderer = load_renderer(path, "target", model="blender_principled", parameters=names, materials=materials)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    assert (renderer.table["emission_strength"].upper, renderer.start[-1]) == (4.0, 0.8)
    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack({"specular_ior_level": 0.0, "emission_strength": 2.0})
    paths = scene.record(renderer.start, grid=10, seed=3, near=False)
    groups = paths.tile_groups(paths.interior)
    got = scene.evaluator(paths, groups)(x)
    textured = f'<texture type="bitmap" name="radiance"><string name="filename" value="{tmp_path / "glow.exr"}"/>'
    textured += '<boolean name="raw" value="true"/></texture></emitter>'
    text = path.read_text("utf-8").replace(GLOW, f'<emitter type="area">{textured}').replace(POINT, "")
    with two_threads():
        lit = mi.load_string(text)
    expected = groups.average(1.5 * np.array(mi.render(lit, spp=256)))
    np.testing.assert_allclose(got[:, :, -1], expected, rtol=0.03, atol=0.005)
    np.testing.assert_allclose(got[:, :, 0], groups.average(renderer.image(x, seed=7, spp=256)), rtol=0.02, atol=0.002)
