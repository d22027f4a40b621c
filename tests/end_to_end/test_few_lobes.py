# SPDX-License-Identifier: Apache-2.0
"""Lobes that few materials have, rendered by Cycles: a coat that has a colour, a film that the start lacks, chrome."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .conftest import Done, Scene, run_bpy

BUILD = """
import json
truth, begin = map(json.loads, argv[4:])
bpy.ops.wm.open_mainfile(filepath=argv[0])
target = bpy.data.objects[argv[1]]
shader = next(n for n in target.active_material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
for name, value in truth.items():
    shader.inputs[name].default_value = value
render(argv[2], 128)
for name, value in begin.items():
    shader.inputs[name].default_value = value
bpy.ops.wm.save_as_mainfile(filepath=argv[3])
"""


GLAZE = {"Base Color": (0.55, 0.42, 0.3, 1.0), "Metallic": 0.0, "Roughness": 0.55, "Coat Weight": 0.9}
GLAZE |= {"Coat Roughness": 0.06, "Coat Tint": (0.35, 0.6, 0.75, 1.0)}
LIGHT_GREY = {"Base Color": (0.8, 0.8, 0.8, 1.0), "Coat Weight": 0.5, "Coat Tint": (0.9, 0.9, 0.9, 1.0)}
BAUBLE = {"Base Color": (0.8, 0.8, 0.82, 1.0), "Metallic": 1.0, "Roughness": 0.3, "Thin Film Thickness": 420.0}
BAUBLE |= {"Thin Film IOR": 1.5}
STEEL = {"Base Color": (0.55, 0.65, 0.6, 1.0), "Metallic": 1.0, "Roughness": 0.45, "Anisotropic": 0.67}
STEEL |= {"Anisotropic Rotation": 0.285}  # across the direction of none
BLENDERS = {"Base Color": (0.8, 0.8, 0.8, 1.0), "Metallic": 0.0, "Roughness": 0.5, "Anisotropic": 0.0}
BLENDERS |= {"Anisotropic Rotation": 0.0}
NO_FILM = {"Base Color": (0.5, 0.5, 0.5, 1.0), "Metallic": 0.5, "Roughness": 0.5, "Thin Film Thickness": 0.0}


@pytest.fixture
def found(scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """What a fit of `begin` to a picture of `truth` says, which is the same as the picture."""

    def fit(truth: dict[str, Any], begin: dict[str, Any]) -> dict[str, Any]:
        start, reference = tmp_path / "start.blend", tmp_path / "reference.exr"
        run_bpy(BUILD, scene.truth, scene.object, reference, start, json.dumps(truth), json.dumps(begin))
        words = ("--object", scene.object, "--reference", reference, "--out", tmp_path / "job")
        done = mfo_here("blend", start, *words)
        assert done.code == 0, done.stderr
        assert done.answer["verdict"] == "same", done.answer["notes"]
        return done.answer

    return fit


def test_all_takes_the_tint_that_a_coat_has(found: Callable[..., dict[str, Any]]) -> None:
    """It kept the grey, and the base had the tint's colour, determined."""
    recovered = found(GLAZE, LIGHT_GREY)["recovered"]
    np.testing.assert_allclose(recovered["coat_tint"], GLAZE["Coat Tint"][:3], atol=0.1)
    np.testing.assert_allclose(recovered["base_color"], GLAZE["Base Color"][:3], atol=0.05)


def test_a_film_is_found_where_the_scene_has_none(found: Callable[..., dict[str, Any]]) -> None:
    """The metal was tinted and *different*, and a note named what was 0."""
    answer = found(BAUBLE, NO_FILM)
    assert any("under a thin film" in note for note in answer["notes"])
    # a lamp's highlight does not tell the order of its colours
    assert answer["certainty"]["thin_film_thickness"]["level"] == "not_told_apart"
    assert abs(answer["recovered"]["thin_film_ior"] - BAUBLE["Thin Film IOR"]) < 0.1


def test_a_brushed_metal_is_found_where_the_scene_has_none(found: Callable[..., dict[str, Any]]) -> None:
    """It was *close*, and a note named what was 0."""
    answer = found(STEEL, BLENDERS)
    assert any("one that is brushed" in note for note in answer["notes"])
    recovered = answer["recovered"]
    np.testing.assert_allclose(recovered["base_color"], STEEL["Base Color"][:3], atol=0.02)
    assert abs(recovered["roughness"] - STEEL["Roughness"]) < 0.04
    assert abs(recovered["anisotropic"] - STEEL["Anisotropic"]) < 0.1
    assert abs(recovered["anisotropic_rotation"] - STEEL["Anisotropic Rotation"]) < 0.02


METAL = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
node = bpy.data.materials["Head"].node_tree.nodes["Principled BSDF"]
values = {"Base Color": (0.8, 0.65, 0.5, 1.0), "Metallic": 1.0, "Roughness": float(argv[2]), "Specular IOR Level": 0.5,
          "Coat Weight": 0.0, "Sheen Weight": 0.0}
for name, value in values.items():
    node.inputs[name].default_value = value
render(argv[1], 256)
"""


@pytest.mark.parametrize("roughness", [0.0, 0.1])
def test_chrome_is_recovered_without_roughness(
    scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path, roughness: float
) -> None:
    """Recorded lobes end at 0.05."""
    reference = tmp_path / "metal.exr"
    run_bpy(METAL, scene.truth, reference, roughness)
    words = ("--object", scene.object, "--reference", reference, "--out", tmp_path / "job")
    done = mfo_here("blend", scene.start, *words)
    assert done.code == 0, done.stderr
    assert done.answer["verdict"] == "same"
    assert done.answer["recovered"]["metallic"] > 0.97
    found, known = (done.answer[name]["roughness"] for name in ("recovered", "certainty"))
    if roughness:
        assert found == pytest.approx(roughness, abs=0.02)
    else:
        assert found == 0.0
        assert known["level"] == "weak"
        assert 0.05 <= known["sd"][0] <= 0.1
