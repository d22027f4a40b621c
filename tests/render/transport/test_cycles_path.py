# SPDX-License-Identifier: Apache-2.0
"""The integrator that treats indirect light as Cycles does. Oracles: Mitsuba's `prb` with everything switched off, and
finite differences. Cycles itself is the oracle in tests/export/scene/test_light_paths.py."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import AREA, FLOOR, LAMPS, POINT, SKY, SUN_AND_SPOT, write_scene

MATERIALS = {
    "target_bsdf": {
        "name": "Glaze",
        "distribution": "MULTI_GGX",
        "sockets": {"Metallic": {"value": 0.5}, "Roughness": {"value": 0.3}, "Base Color": {"value": [0.7, 0.5, 0.3]}},
    }
}
ALL = LightPaths(filter_glossy=1.0, clamp_indirect=0.5, diffuse_bounces=1, glossy_bounces=1)


def load(folder, light_paths, lights=AREA + FLOOR, materials=MATERIALS):
    return load_renderer(
        write_scene(folder, lights, size=16, depth=5),
        "target",
        model="blender_principled",
        parameters=["base_color", "roughness"],
        materials=materials,
        light_paths=light_paths,
    )


@pytest.mark.parametrize("lights", [AREA + FLOOR, SKY + FLOOR, POINT], ids=["areas", "sky", "point"])
def test_with_everything_off_it_is_mitsubas_path_tracer(tmp_path, lights):
    ours, theirs = (load(tmp_path, choice, lights).image for choice in (LightPaths(), None))
    start = load(tmp_path, None, lights).start
    a, b = (
        np.array([render(start, seed=seed, spp=128).mean(axis=(0, 1)) for seed in range(8)])
        for render in (ours, theirs)
    )
    noise = np.sqrt(a.var(axis=0) + b.var(axis=0)) / np.sqrt(8)
    assert np.all(np.abs(a.mean(axis=0) - b.mean(axis=0)) < 4 * noise + 1e-6)
    assert np.all(noise < 0.02 * b.mean(axis=0))


@pytest.mark.parametrize("light_paths", [LightPaths(), ALL], ids=["off", "all"])
def test_the_pull_back_is_the_slope_of_the_picture(tmp_path, light_paths):
    """Differences with equal random numbers; what differs is that sampled directions move with the roughness."""
    renderer = load(tmp_path, light_paths, SKY + FLOOR)
    weight = np.random.default_rng(0).uniform(0, 1, (16, 16, 3)).astype(np.float32)
    step, slopes, differences = 0.02, [], []
    for seed in range(6):
        slopes.append(renderer.image_and_pullback(renderer.start, seed=seed, spp=256)[1](weight))
        row = []
        for index in (1, 3):
            change = step * np.eye(4)[index]
            up, down = (renderer.image(renderer.start + s * change, seed=seed, spp=256) for s in (1, -1))
            row.append(float(np.sum(weight * (up.astype(float) - down))) / (2 * step))
        differences.append(row)
    slopes, differences = np.array(slopes)[:, (1, 3)], np.array(differences)
    noise = np.sqrt((slopes.var(axis=0) + differences.var(axis=0)) / 6)
    error = np.abs(slopes.mean(axis=0) - differences.mean(axis=0))
    assert np.all(error < 0.005 * np.abs(differences.mean(axis=0)) + 4 * noise)
    assert noise[0] < 0.005 * abs(differences[:, 0].mean())


def test_a_clamp_bounds_what_arrives_over_other_surfaces_alone(tmp_path):
    pictures = {}
    for name, clamp in (("free", 0.0), ("clamped", 1e-6)):
        renderer = load(tmp_path, LightPaths(clamp_indirect=clamp))
        pictures[name] = renderer.image(renderer.start, seed=0, spp=128)
    direct = load_renderer(
        write_scene(tmp_path, AREA + FLOOR, size=16, depth=2),
        "target",
        model="blender_principled",
        parameters=["base_color", "roughness"],
        materials=MATERIALS,
    )
    expected = direct.image(direct.start, seed=0, spp=512).mean()
    assert pictures["clamped"].mean() == pytest.approx(expected, rel=0.01)  # noise of both
    assert pictures["free"].mean() > 1.1 * expected


SHADOWLESS = LAMPS["sharp spot"].replace("</emitter>", '<boolean name="shadow" value="false"/></emitter>')
LONE = SUN_AND_SPOT.replace("20, 20, 20", "60, 50, 20")


@pytest.mark.parametrize(
    ("lights", "quieter"),
    [(LONE, 10.0), (LONE + POINT + SHADOWLESS + FLOOR, 2.0)],
    ids=["no other surface", "over a floor"],
)
def test_pixels_have_the_light_of_every_lamp_without_extent(tmp_path, monkeypatch, lights, quieter):
    """The oracle is the picture of all pixels, whose samples draw one of the lamps each."""
    from mfo_backend.render.pictures import pixel_pictures

    expected = load(tmp_path, ALL, lights)
    expected = np.array([expected.image(expected.start, seed=k, spp=1024).reshape(-1, 3) for k in range(8)])
    noise = {}
    for most in (8, 1):
        monkeypatch.setattr(pixel_pictures, "MOST_SUMMED", most)
        renderer = load(tmp_path, ALL, lights)
        found = np.array([renderer.pixels_later(renderer.start, np.arange(256), seed=k, spp=4)() for k in range(64)])
        variance = found.var(axis=0) / len(found) + expected.var(axis=0) / len(expected)
        away = (found.mean(axis=0) - expected.mean(axis=0)) / np.sqrt(variance + (1e-3 * expected.mean()) ** 2)
        assert np.sqrt(np.square(away).mean()) < 1.25  # Student's, as in tests/render/pictures/test_pixel_pictures.py
        noise[most] = found.var(axis=0).mean()
    assert quieter * noise[8] < noise[1]


def test_recorded_paths_hold_the_same_light(tmp_path):
    """A matt ball over a floor that reflects the lamp on it; Filter Glossy spreads that light."""
    lights = POINT + FLOOR.replace('<bsdf type="diffuse">', '<bsdf type="diffuse" id="x">')
    floor = '<bsdf type="principled" id="floor_bsdf"/>'
    lights = floor + re.sub(r'<bsdf type="diffuse" id="x">.*?</bsdf>', '<ref id="floor_bsdf"/>', lights)
    means = {}
    for name, light_paths in (("on", ALL), ("off", dataclasses.replace(ALL, filter_glossy=0.0))):
        materials = {
            "target_bsdf": {"name": "Matt", "sockets": {"Roughness": {"value": 1.0}}},
            "floor_bsdf": {"name": "Floor", "sockets": {"Metallic": {"value": 1.0}, "Roughness": {"value": 0.3}}},
        }
        renderer = load(tmp_path, light_paths, lights, materials=materials)
        from mfo_backend.render.paths.recorded_scene import RecordedScene

        scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
        paths = scene.record(renderer.start, grid=24, seed=3, near=False)
        groups = paths.tile_groups()
        got = scene.evaluator(paths, groups)(renderer.start)[:, :, 0]
        expected = groups.average(renderer.image(renderer.start, seed=0, spp=1024))
        means[name] = got.mean(), expected.mean()
    for got, expected in means.values():
        assert got == pytest.approx(expected, rel=0.01)
    assert abs(means["on"][1] / means["off"][1] - 1) > 0.05


def test_mitsubas_own_model_goes_without(tmp_path):
    renderer = load_renderer(
        write_scene(tmp_path, POINT, size=8),
        "target",
        model="mitsuba_principled",
        parameters=["roughness"],
        light_paths=ALL,
    )
    assert renderer.light_paths is None


@pytest.mark.parametrize("model", ["mitsuba_principled", "blender_principled"])
def test_every_model_shows_the_camera_its_own_world(tmp_path, model):
    """Behind the ball the camera sees one world, while another lights it."""
    squares = "".join(f'<rgb name="color{number}" value="0.1, 0.2, 0.3"/>' for number in (0, 1))
    seen = f'<texture type="checkerboard" id="camera_world">{squares}</texture>'
    path = write_scene(tmp_path, SKY + seen, size=16)
    materials = MATERIALS if model == "blender_principled" else {}
    renderer = load_renderer(path, "target", model=model, parameters=["base_color"], materials=materials)
    picture = renderer.image(renderer.start, seed=0, spp=16)
    np.testing.assert_allclose(picture[0, 0], (0.1, 0.2, 0.3), atol=1e-5)
    assert picture[8, 8].min() > 0.1


# Cycles 5.0.1, one surface of rough glass in a uniform world of radiance 1, whose light it leaves to the material
@pytest.mark.parametrize(("angle", "expected"), [(20, (0.95046, 0.89777, 0.84174)), (70, (0.95128, 0.89949, 0.84474))])
def test_rough_glass_in_a_uniform_world(angle, expected):
    import mitsuba as mi

    from mfo_backend.material.plugins import principled_plugin
    from mfo_backend.render.transport import cycles_path

    principled_plugin.register()
    cycles_path.register()
    glass = {"base_color": {"type": "rgb", "value": [0.9, 0.8, 0.7]}, "transmission_weight": 1.0}
    x, z = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    camera = mi.ScalarTransform4f().look_at([5 * x, 0, 5 * z], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "cycles_path", "max_depth": 2},
            "sensor": {"type": "orthographic", "to_world": camera, "film": film},
            "world": {"type": "constant"},
            "pane": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().scale(50),
                "bsdf": {"type": "blender_principled", "filtered": True, **glass},
            },
        }
    )
    pixels = np.array(mi.render(scene, spp=4096, seed=1)).reshape(-1, 3)
    error = pixels.std(axis=0) / np.sqrt(len(pixels))
    assert np.all(np.abs(pixels.mean(axis=0) - expected) < 4 * error + 1e-4)
