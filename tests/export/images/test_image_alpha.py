# SPDX-License-Identifier: Apache-2.0
"""Alpha of pictures that Open Shading Language reads by itself: named where Cycles has other colours."""

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
