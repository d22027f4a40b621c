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
from tests.render.scenes import POINT, SKY, write_scene

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
