# SPDX-License-Identifier: Apache-2.0
"""Pictures that Open Shading Language reads by itself: named where Cycles has other colours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from studies.parity.cycles_parity import render_job  # noqa: E402

from ..scenes import add_camera, add_quad, new_material, world_color  # noqa: E402

SAID = "Open Shading Language multiplies the colours of"
ENDS = {"PNG": "png", "OPEN_EXR": "exr", "JPEG": "jpg"}


def picture(folder: Path, kind: str, mode: str) -> Any:
    """A file of random colours and alpha."""
    made = bpy.data.images.new("Made", 8, 8, alpha=True, float_buffer=kind == "OPEN_EXR")
    made.pixels.foreach_set(np.random.default_rng(1).random(256).astype(np.float32))
    made.filepath_raw, made.file_format = str(folder / f"made.{ENDS[kind]}"), kind
    made.save()
    image = bpy.data.images.load(made.filepath_raw)
    image.alpha_mode = mode
    return image


@pytest.mark.parametrize(
    ("kind", "mode", "by_language", "is_said"),
    [("PNG", "NONE", True, True), ("PNG", "CHANNEL_PACKED", True, True), ("OPEN_EXR", "STRAIGHT", True, True),
     ("JPEG", "NONE", True, False), ("PNG", "NONE", False, False)],
)  # fmt: skip
def test_what_is_not_said_is_as_in_cycles(
    scene: Any, export: Any, render_cycles: Callable[[], Any], tmp_path: Path,
    kind: str, mode: str, by_language: bool, is_said: bool,
) -> None:  # fmt: skip
    """Of a floor by a picture whose alpha is its roughness."""
    world_color(scene, 1.0)
    scene.cycles.shading_system, scene.cycles.samples = by_language, 128
    add_camera("ORTHO", ortho_scale=2.0)
    target, material = add_quad("Target", 0.5, 0.5, new_material("Target")), new_material("Floor")
    add_quad("Floor", 3.0, 0.0, material).data.uv_layers.new(name="UVMap")
    tree = material.node_tree
    node, shader = tree.nodes.new("ShaderNodeTexImage"), tree.get_output_node("CYCLES").inputs[0].links[0].from_node
    node.image = picture(tmp_path, kind, mode)
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(node.outputs["Alpha"], shader.inputs["Roughness"])
    bpy.context.view_layer.update()
    theirs = render_cycles()
    report = export(target, reference=bpy.data.images.new("Any", 32, 32))
    assert any(note.startswith(SAID) for note in report.notes) == is_said
    if not is_said:
        ours = np.mean(render_job(report.folder, 128), axis=0)
        assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)


@pytest.mark.parametrize("is_packed", [False, True])
def test_a_file_that_this_language_averages_is_named(
    scene: Any, in_both: Callable[[Any], Any], tmp_path: Path, is_packed: bool
) -> None:
    """A ball is black where random numbers are low: their means are not, and none of the language's packed files."""
    world_color(scene, 1.0)
    scene.cycles.shading_system, scene.cycles.samples = True, 256
    add_camera("ORTHO", ortho_scale=2.2)
    target, material = add_quad("Target", 0.2, 1.1, new_material("Target")), new_material("Ball")
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.context.object.data.materials.append(material)
    tree = material.node_tree
    fine, node, above = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Mapping", "TexImage", "Math"))
    fine.inputs["Scale"].default_value = (8.0, 8.0, 1.0)
    node.image, above.operation, above.inputs[1].default_value = picture(tmp_path, "JPEG", "NONE"), "GREATER_THAN", 0.3
    if is_packed:
        node.image.pack()
    shader = tree.get_output_node("CYCLES").inputs[0].links[0].from_node
    for source, socket in (
        (tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], fine.inputs["Vector"]),
        (fine.outputs["Vector"], node.inputs["Vector"]),
        (node.outputs["Color"], above.inputs[0]),
        (above.outputs[0], shader.inputs["Base Color"]),
    ):
        tree.links.new(source, socket)
    report, ours, theirs = in_both(target)
    assert any("Open Shading Language averages the pixels of" in note for note in report.notes) == (not is_packed)
    off = abs((ours - theirs).mean(axis=2)).reshape(4, 8, 4, 8).mean(axis=(1, 3)).max() / theirs.mean()
    assert (off < 0.1) == is_packed
