# SPDX-License-Identifier: Apache-2.0
"""Blender's Principled on recorded paths. Oracle: its Mitsuba plugin under Mitsuba's own integrator."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image
from tests.render.scenes import AREA, FLOOR, POINT, SKY, write_scene

NAMES = ["base_color", "metallic", "roughness", "specular_ior_level", "coat_weight", "coat_roughness"]
TRUTH = {
    "base_color": (0.7, 0.3, 0.1),
    "metallic": 0.3,
    "roughness": 0.4,
    "specular_ior_level": 0.6,
    "coat_weight": 0.5,
    "coat_roughness": 0.15,
}


def load(folder, lights, names=NAMES, sockets=None, **options):
    materials = {"target_bsdf": {"name": "Glaze", "distribution": "MULTI_GGX", "sockets": sockets or {}}}
    path = write_scene(folder, lights, **options)
    return load_renderer(path, "target", model="blender_principled", parameters=names, materials=materials)


@pytest.mark.parametrize("lights", [POINT, SKY], ids=["point", "sky"])
def test_equals_the_path_traced_picture(tmp_path, lights):
    renderer = load(tmp_path, lights)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack(TRUTH)
    paths = scene.record(x, grid=10, seed=3, near=False)
    groups = paths.tile_groups()
    got = scene.evaluator(paths, groups)(x)[:, :, 0]
    expected = groups.average(renderer.image(x, seed=7, spp=1024))
    error = np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2))
    assert error < 0.02  # noise of 1024 and 100 samples at the silhouette


@pytest.mark.parametrize("coat", [0.0, 0.5])
def test_a_sharp_coat_that_mirrors_the_room_has_little_noise_near_the_solution(tmp_path, monkeypatch, coat):
    """Light over other surfaces is met by samples of the proposal alone: few of a rough base lie in the lobe of a coat.

    Oracle: the path tracer, which draws from the coat by its weight.
    """
    renderer = load(tmp_path, AREA + FLOOR, depth=4)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    x = renderer.table.pack({**TRUTH, "roughness": 0.6, "coat_weight": coat, "coat_roughness": 0.03})
    expected = np.mean([renderer.image(x, seed=seed, spp=1024) for seed in range(4)], axis=0)

    def recorded():
        scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
        paths = scene.record(x, grid=8, seed=3, near=True, samples=2)
        groups = paths.tile_groups(paths.interior)
        found, light = scene.pictures(paths, groups).samples(x), groups.average(expected)
        noise = np.sqrt(np.mean((found.half_difference[:, :, 0] / light) ** 2))
        return noise, np.mean(found.mean[:, :, 0]) / np.mean(light)

    noise, level = recorded()
    monkeypatch.setattr(RecordedScene, "_coat", lambda self, vector: None)
    without, _ = recorded()
    assert level == pytest.approx(1.0, abs=0.01)
    if coat:
        assert noise < 0.5 * without  # 0.0102 for 0.0273
    else:
        assert noise == without


@pytest.mark.parametrize(
    ("weight", "found", "user", "lobe"),
    [(0.5, 0.3, 0.03, 0.03), (0.5, 0.05, 0.3, 0.05), (0.0, 0.05, 0.03, None)],
    ids=["the user's", "the found one's", "no coat"],
)
def test_the_lobe_for_a_coat_is_as_sharp_as_the_coat_may_become(tmp_path, monkeypatch, weight, found, user, lobe):
    renderer = load(tmp_path, SKY)
    from mfo_backend.render.paths import recorded_scene

    proposals = []
    monkeypatch.setattr(
        recorded_scene, "record_paths", lambda scene, shape, settings: proposals.append(settings.proposal)
    )
    renderer.start = renderer.table.pack({**TRUTH, "coat_roughness": user})
    scene = recorded_scene.RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack({**TRUTH, "coat_weight": weight, "coat_roughness": found})
    for near in (True, False):
        scene.record(x, grid=2, seed=1, near=near)
    lobes = [dict(zip(each.roughness, each.share, strict=True)) for each in proposals]
    assert (lobes[0].get(lobe) or 0.0) == (0.2 if lobe else 0.0)
    assert sum(proposals[0].share) == pytest.approx(0.8 if lobe else 0.75)
    assert proposals[1].share[-1] == 0.0  # the search looks for any material


def test_a_point_light_fit_reproduces_the_picture(tmp_path):
    renderer = load(tmp_path, POINT, NAMES[:4], size=32)  # the coat's highlight is finer than these pixels
    x = renderer.table.pack(TRUTH)
    reference = renderer.image(x, seed=5, spp=1024)
    outcome = recover_material(
        renderer,
        Image(reference, Encoding.LINEAR),
        FitSettings(model="blender_principled", preset="fast", verify_spp=32),
        listener=lambda event: None,
        should_stop=lambda: False,
    )
    mask = renderer.target_mask()
    result = renderer.image(renderer.table.pack(outcome.result.recovered), seed=5, spp=1024)
    error = np.sqrt(np.mean((result - reference)[mask] ** 2) / np.mean(reference[mask] ** 2))
    assert error < 0.01


def test_glass_is_refused(tmp_path):
    renderer = load(tmp_path, POINT, ["roughness"], {"Transmission Weight": {"value": 0.5, "linked": False}})
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    with pytest.raises(BadInputError, match="'transmission_weight'"):
        RecordedScene(renderer, 1)
