# SPDX-License-Identifier: Apache-2.0
"""A picture whose pixels are twice as wide as high, rendered by Cycles."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from .conftest import Done, Scene, run_bpy

BUILD = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
scene = bpy.context.scene
scene.render.pixel_aspect_x, scene.render.resolution_y = 2.0, 2 * scene.render.resolution_y
shader = bpy.data.objects[argv[3]].active_material.node_tree.nodes["Principled BSDF"]
shader.inputs["Metallic"].default_value = 0.0
if argv[2]:
    for name, value in (("Base Color", (0.8, 0.15, 0.1, 1.0)), ("Roughness", 0.3)):
        shader.inputs[name].default_value = value
    scene.cycles.samples, scene.cycles.seed = 256, 5
    scene.render.filepath = argv[2]
    bpy.ops.render.render(write_still=True)
bpy.ops.wm.save_as_mainfile(filepath=argv[1])
"""


def test_their_blur_is_not_taken_for_the_materials(scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path) -> None:
    """A toy's Base Color, Metallic and Roughness were determined and four to five deviations off."""
    start, truth, reference = tmp_path / "start.blend", tmp_path / "truth.blend", tmp_path / "reference.png"
    run_bpy(BUILD, scene.start, start, "", scene.object)
    run_bpy(BUILD, scene.truth, truth, reference, scene.object)
    words = ("--object", scene.object, "--reference", reference, "--out", tmp_path / "job")
    done = mfo_here("blend", start, *words)
    assert done.code == 0, done.stderr
    for name, true in (("base_color", (0.8, 0.15, 0.1)), ("metallic", 0.0), ("roughness", 0.3)):
        off = np.abs(np.subtract(done.answer["recovered"][name], true))
        assert (off < 0.02 + 3.0 * np.array(done.answer["certainty"][name]["sd"])).all(), name
