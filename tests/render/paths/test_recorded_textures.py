# SPDX-License-Identifier: Apache-2.0
"""Textures in the target's material on recorded paths. Oracle: the plugin under Mitsuba's own integrator."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.scene.exr_file import write_exr
from mfo_backend.types.image import Encoding, Image
from tests.render.scenes import POINT, SKY, write_scene

TRUTH = {"roughness": 0.35, "specular_ior_level": 0.7, "coat_weight": 0.6}


@pytest.fixture
def sockets(tmp_path):
    rng = np.random.default_rng(1)
    colour, metal = tmp_path / "colour.exr", tmp_path / "metal.exr"
    write_exr(colour, rng.uniform(0.1, 0.9, (8, 16, 3)).astype(np.float32))
    write_exr(metal, np.repeat(rng.uniform(0.0, 0.5, (4, 8, 1)), 3, axis=2).astype(np.float32))
    return {
        "Base Color": {"value": [0.5, 0.5, 0.5], "linked": True, "texture": str(colour)},
        "Metallic": {"value": 0.0, "linked": True, "texture": str(metal)},
        "Coat Roughness": {"value": 0.2, "linked": False},
    }


def load(folder, lights, sockets, **options):
    materials = {"target_bsdf": {"name": "Cloth", "distribution": "MULTI_GGX", "sockets": sockets}}
    path = write_scene(folder, lights, **options)
    return load_renderer(path, "target", model="blender_principled", parameters=list(TRUTH), materials=materials)


@pytest.mark.parametrize("lights", [POINT, SKY], ids=["point", "sky"])
def test_equals_the_path_traced_picture(tmp_path, sockets, lights):
    renderer = load(tmp_path, lights, sockets)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack(TRUTH)
    paths = scene.record(x, grid=10, seed=3, near=False)
    assert paths.bytes == paths.lanes * (36 + 12 + 4)
    groups = paths.tile_groups()
    got = scene.evaluator(paths, groups)(x)[:, :, 0]
    expected = groups.average(renderer.image(x, seed=7, spp=1024))
    error = np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2))
    assert error < 0.02  # noise of 1024 and 100 samples at the silhouette


def test_values_beside_the_textures_are_recovered(tmp_path, sockets):
    renderer = load(tmp_path, POINT, sockets, size=40)
    x = renderer.table.pack(TRUTH)
    outcome = recover_material(
        renderer,
        Image(renderer.image(x, seed=5, spp=1024), Encoding.LINEAR),
        FitSettings(model="blender_principled", preset="fast", verify_spp=32),
        listener=lambda event: None,
        should_stop=lambda: False,
    )
    assert [stage.name for stage in outcome.result.stages] == ["scan", "start", "refine"]
    found = renderer.table.pack(outcome.result.recovered)
    np.testing.assert_allclose(found, x, atol=0.02)
