# SPDX-License-Identifier: Apache-2.0
"""One picture by two nodes, its colours by the one and its alpha by the other, as Cycles has them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from ..materials.test_node_graphs import principled  # noqa: E402
from ..scene.test_light_paths import picture_of, scene_reference  # noqa: E402
from ..scenes import add_camera, add_quad, new_material  # noqa: E402


def glowing(image: Any, *, is_alike: bool, through_nodes: bool, mapped: bool) -> Any:
    """A material that glows in an image's colours and is cut out by its alpha, by a node of its own each."""
    material = new_material("Leaves", Base_Color=(0.0, 0.0, 0.0), Specular_IOR_Level=0.0)
    tree, shader = material.node_tree, principled(material)
    shader.inputs["Emission Strength"].default_value = 1.0
    colours, alphas = (tree.nodes.new("ShaderNodeTexImage") for _ in range(2))
    for node in (colours, alphas):
        node.image, node.interpolation = image, "Linear"
        if mapped:
            moved = tree.nodes.new("ShaderNodeMapping")
            moved.inputs["Scale"].default_value = (2.0, 2.0, 1.0)
            tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], moved.inputs["Vector"])
            tree.links.new(moved.outputs[0], node.inputs["Vector"])
    if not is_alike:
        alphas.extension = "MIRROR"
    shown = colours.outputs["Color"]
    if through_nodes:
        hue = tree.nodes.new("ShaderNodeHueSaturation")
        hue.inputs["Hue"].default_value = 0.6
        tree.links.new(shown, hue.inputs["Color"])
        shown = hue.outputs[0]
    tree.links.new(shown, shader.inputs["Emission Color"])
    tree.links.new(alphas.outputs["Alpha"], shader.inputs["Alpha"])
    return material


@pytest.mark.parametrize("is_target", [True, False], ids=["target", "other"])
@pytest.mark.parametrize("through_nodes", [True, False], ids=["by nodes", "as it is"])
@pytest.mark.parametrize(("is_alike", "mapped"), [(True, False), (True, True), (False, False)])
def test_colours_are_divided_where_a_like_node_reads_alpha(
    is_target: bool, through_nodes: bool, is_alike: bool, mapped: bool, scene: Any, export: Any, render_cycles: Any,
    tmp_path: Path,
) -> None:  # fmt: skip
    values = np.full((4, 4, 4), 0.8, np.float32)
    values[..., 3] = np.linspace(0.2, 0.7, 16).reshape(4, 4)
    image = bpy.data.images.new("Leaves", 4, 4, alpha=True)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(tmp_path / "leaves.png"), "PNG"
    image.save()
    made = glowing(
        bpy.data.images.load(image.filepath_raw), is_alike=is_alike, through_nodes=through_nodes, mapped=mapped
    )
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.cycles.samples = 256
    add_camera("ORTHO", ortho_scale=2.2)
    quad = add_quad("Leaves", 1.0, 0.0, made)
    target = quad if is_target else add_quad("Target", 0.05, 0.1, new_material("Target"))
    wanted = render_cycles()
    found = picture_of(export(target, reference=scene_reference(wanted)))
    # of colours that are multiplied by alpha a half would be left
    np.testing.assert_allclose(found.mean(axis=(0, 1)), wanted.mean(axis=(0, 1)), rtol=0.02)
