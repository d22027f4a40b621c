# SPDX-License-Identifier: Apache-2.0
"""Pictures whose file is missing. Oracle: Cycles."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from ..scenes import add_camera, add_light, add_quad, new_material


@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP"])
@pytest.mark.parametrize(("output", "shown"), [("Color", (1.0, 0.0, 1.0)), ("Alpha", (1.0, 1.0, 1.0))])
@pytest.mark.parametrize("has_image", [True, False])
def test_a_missing_picture_is_one_colour_wherever_it_is_looked_up(
    scene: Any, export: Any, render_cycles: Any, space: str, extension: str, output: str, shown: Any, has_image: bool
) -> None:
    """Oracle: Cycles' picture of its glow, beside the picture and by box projection.

    No Blender is asked for it but where it is clipped.
    """
    material = new_material("Target", Base_Color=(0.0, 0.0, 0.0), Specular_IOR_Level=0.0, Emission_Strength=1.0)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    node = nodes.new("ShaderNodeTexImage")
    if has_image:
        node.image = bpy.data.images.new("gone.png", 4, 4)
        node.image.source, node.image.filepath = "FILE", "//gone.png"
        node.image.colorspace_settings.name = space
    node.extension, node.projection = extension, "BOX"
    moved = nodes.new("ShaderNodeMapping")
    moved.inputs["Location"].default_value = (7.3, 5.1, 0.0)
    coordinate = nodes.new("ShaderNodeTexCoord")
    links.new(coordinate.outputs["Object"], moved.inputs["Vector"])
    links.new(moved.outputs[0], node.inputs["Vector"])
    links.new(node.outputs[output], nodes["Principled BSDF"].inputs["Emission Color"])
    add_camera("ORTHO", ortho_scale=1.0)
    target = add_quad("Target", 1.0, 0.0, material)
    add_light("POINT", energy=10.0)
    shown = shown if extension != "CLIP" else (0.0, 0.0, 0.0)
    found = np.asarray(render_cycles())
    np.testing.assert_allclose(found[..., :3].mean(axis=(0, 1)), shown, atol=1e-3)
    socket = export(target).request["materials"]["target_bsdf"]["sockets"]["Emission Color"]
    assert ("graph" in socket) == (extension == "CLIP")
    assert socket["linked"]
    np.testing.assert_allclose(socket["value"], shown, atol=1e-6)
