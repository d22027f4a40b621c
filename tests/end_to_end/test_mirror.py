# SPDX-License-Identifier: Apache-2.0
"""Chrome has no roughness, where recorded lobes end at 0.05; rendered by Cycles."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import Done, Scene, run_bpy

METAL = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
node = bpy.data.materials["Head"].node_tree.nodes["Principled BSDF"]
values = {"Base Color": (0.8, 0.65, 0.5, 1.0), "Metallic": 1.0, "Roughness": float(argv[2]), "Specular IOR Level": 0.5,
          "Coat Weight": 0.0, "Sheen Weight": 0.0}
for name, value in values.items():
    node.inputs[name].default_value = value
scene = bpy.context.scene
scene.cycles.samples, scene.cycles.seed = 256, 5
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "IMAGE"
settings.file_format, scene.render.filepath = "OPEN_EXR", argv[1]
bpy.ops.render.render(write_still=True)
"""


@pytest.mark.parametrize("roughness", [0.0, 0.1])
def test_chrome_is_recovered_without_roughness(
    scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path, roughness: float
) -> None:
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
