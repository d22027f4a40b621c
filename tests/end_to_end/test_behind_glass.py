# SPDX-License-Identifier: Apache-2.0
"""A target that the camera sees through a pane alone, rendered by Cycles."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from .conftest import Done, Scene, run_bpy

PANE = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
scene = bpy.context.scene
camera, target = scene.camera, bpy.data.objects[argv[3]]
glass = bpy.data.materials.new("Glass")
if glass.node_tree is None:
    glass.use_nodes = True
tree = glass.node_tree
shader = tree.nodes.new("ShaderNodeBsdfGlass")
shader.inputs["Roughness"].default_value = 0.0
tree.links.new(shader.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
bpy.ops.mesh.primitive_plane_add(size=10.0)
pane = bpy.context.object
pane.data.materials.append(glass)
pane.location = 0.6 * camera.location + 0.4 * target.location
pane.rotation_euler = camera.rotation_euler
pane.modifiers.new("Thickness", "SOLIDIFY").thickness = 0.02
bpy.context.view_layer.objects.active = target
bpy.ops.wm.save_as_mainfile(filepath=argv[1])
if argv[2]:
    render(argv[2], 128)
"""


def test_whole_paths_find_it(scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path) -> None:
    """It was refused."""
    start, truth, reference = (tmp_path / name for name in ("start.blend", "truth.blend", "reference.exr"))
    run_bpy(PANE, scene.start, start, "", scene.object)
    run_bpy(PANE, scene.truth, truth, reference, scene.object)
    words = ("--object", scene.object, "--reference", reference, "--out", tmp_path / "job")
    done = mfo_here("blend", start, *words, "--parameters", "base_color,roughness,metallic")
    assert done.code == 0, done.stderr
    assert done.answer["verdict"] == "same"
    assert any("through glass" in note for note in done.answer["notes"])
    found = done.answer["recovered"]
    np.testing.assert_allclose(found["base_color"], (0.826, 0.637, 0.761), atol=0.05)
    assert abs(found["roughness"] - 0.682) < 0.08
    assert abs(found["metallic"] - 0.9) < 0.15
