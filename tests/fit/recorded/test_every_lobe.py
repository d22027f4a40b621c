# SPDX-License-Identifier: Apache-2.0
"""Fits of each lobe of Blender's model, and of a material with holes, run to their end by all their kernels, and find
the picture."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.material.principled.principled_parameters import parameter_to_socket
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.scene.exr_file import write_exr
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.light_paths import LightPaths
from mfo_backend.types.status import Status
from tests.fit.traced import glass
from tests.material.materials import MATERIALS
from tests.render.scenes import POINT, SKY, write_scene

GREY = (0.5, 0.5, 0.5)
OPAQUE = {name: values for name, values in MATERIALS.items() if "transmission_weight" not in values}
MATT = {"Roughness": 1.0, "Specular IOR Level": 0.0}
# shaders that are no Principled BSDF, by what an export gives of them: one lobe, and the others off
ALONE = {
    "diffuse": ("principled", MATT),
    "sheen": ("principled", {**MATT, "Base Color": (0.0,) * 3, "Sheen Weight": 1.0, "Sheen Tint": GREY}),
    "glossy": ("glossy", {"Metallic": 1.0, "Roughness": 0.5}),
    "toon": ("toon", {**MATT, "Base Color": (0.0,) * 3, "Sheen Weight": 1.0, "Sheen Tint": GREY}),
    "glass": ("glass", {"Transmission Weight": 1.0, "Roughness": 0.5}),
    "refraction": ("refraction", {"Transmission Weight": 1.0, "Roughness": 0.5}),
    "translucent": ("translucent", {}),
    "subsurface": ("subsurface", {**MATT, "Subsurface Weight": 1.0}),
}
# normals that lean far from the faces: each group of lobes is evaluated about one of its own
LEANING = '<texture type="uniform" name="leaning_normals"><float name="value" value="1"/></texture>'


def loaded(folder, lights, sockets, shader="principled", shape=""):
    """The renderer of a target with these sockets, which begins at grey."""
    given = {"shader": shader, "sockets": {key: {"value": value} for key, value in sockets.items()}}
    path = write_scene(folder, lights, size=24, shape=shape)
    return load_renderer(
        path, "target", model="blender_principled", parameters="all", materials={"target_bsdf": given},
        light_paths=LightPaths(),
    )  # fmt: skip


def fitted(renderer, truth):
    """How far the fit of a picture of these values ends from it, root mean square, as a share of it; its notes."""
    reference, mask = renderer.image(truth, seed=5, spp=512), renderer.target_mask()
    outcome = recover_material(
        renderer, Image(reference, Encoding.LINEAR), FitSettings(preset="fast"),
        listener=lambda event: None, should_stop=lambda: False,
    )  # fmt: skip
    assert outcome.result.status is Status.CONVERGED
    found = renderer.image(renderer.table.pack(outcome.result.recovered), seed=5, spp=512)
    error = np.sqrt(np.mean((found - reference)[mask] ** 2) / np.mean(reference[mask] ** 2))
    return error, outcome.result.notes


# the sky is nearly the same from all sides, and the target fills nine tiles: materials are hardly told apart
@pytest.mark.parametrize(("lights", "most"), [(POINT, 0.05), (SKY, 0.15)], ids=["lamp", "sky"])
@pytest.mark.parametrize("name", OPAQUE)
def test_a_fit_of_each_lobe_ends_at_its_picture(tmp_path, name, lights, most):
    sockets = {parameter_to_socket(key): value for key, value in OPAQUE[name].items()}
    renderer = loaded(tmp_path, lights, sockets | {"Base Color": GREY, "Roughness": 0.6})
    truth = renderer.table.pack(renderer.table.unpack(renderer.start) | OPAQUE[name])
    assert fitted(renderer, truth)[0] < most


@pytest.mark.parametrize("shape", ["", LEANING], ids=["plain", "leaning"])
@pytest.mark.parametrize("name", ALONE)
def test_a_fit_of_each_shader_alone_ends_at_its_picture(tmp_path, name, shape):
    shader, sockets = ALONE[name]
    renderer = loaded(tmp_path, SKY + POINT, {"Base Color": GREY, **sockets}, shader, shape)
    color = "sheen_tint" if name in ("sheen", "toon") else "base_color"
    truth = renderer.table.with_values(renderer.start, **{color: np.array([0.7, 0.3, 0.2])})
    error, notes = fitted(renderer, truth)
    assert error < 0.2
    traced = any("whole light paths were traced" in note for note in notes)
    assert traced == (name in ("glass", "refraction", "translucent"))  # what light passes


SEEN = {"base_color": (0.7, 0.4, 0.2), "roughness": 0.4, "metallic": 0.7}


@pytest.mark.parametrize("even", [False, True])
def test_values_of_a_material_with_holes_are_recovered(even, tmp_path):
    """A texture's holes, and an even alpha, which leaves no pixel without background."""
    alpha = {"value": 0.6, "linked": not even}
    if not even:
        cells = np.random.default_rng(4).choice([0.0, 1.0], (4, 8, 1))
        write_exr(tmp_path / "alpha.exr", np.repeat(cells, 3, axis=2).astype(np.float32))
        alpha["texture"] = str(tmp_path / "alpha.exr")
    renderer = glass.load(tmp_path, list(SEEN), {"Alpha": alpha}, size=40)
    x, found = renderer.table.pack(SEEN), []
    for seed in range(5, 10):
        result, _ = glass.fit(renderer, renderer.image(x, seed=seed, spp=64), seed=seed)
        assert [stage.name for stage in result.stages] == ["scan", "start", "refine"]
        found.append(renderer.table.pack(result.recovered))
    # by the noise of 64 samples a pixel and of the recordings, which one seed for all fits would make the same
    np.testing.assert_allclose(np.median(found, axis=0), x, atol=0.05)
    np.testing.assert_allclose(found, np.broadcast_to(x, (5, len(x))), atol=0.15)
