# SPDX-License-Identifier: Apache-2.0
"""A material with values inside its nodes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest


@pytest.fixture
def graph(scene: SimpleNamespace) -> SimpleNamespace:
    """Noise through a ramp of three stops, mixed with a colour by a group that another material has, too; the ramp is
    the roughness as well, and another ramp is nothing but the roughness of the coat."""
    bpy = scene.bpy
    material = bpy.data.materials["Glaze"]
    if material.node_tree is None:
        material.use_nodes = True
    tree: Any = material.node_tree
    shader = tree.nodes["Principled BSDF"]
    group: Any = bpy.data.node_groups.new("Wash", "ShaderNodeTree")
    group.interface.new_socket("Under", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    mix, entry = group.nodes.new("ShaderNodeMix"), group.nodes.new("NodeGroupInput")
    mix.data_type = "RGBA"
    group.links.new(entry.outputs["Under"], mix.inputs["A"] if mix.inputs["A"].type == "RGBA" else mix.inputs[6])
    group.links.new(entry.outputs["Paint"], mix.inputs[7])
    group.links.new(mix.outputs[2], group.nodes.new("NodeGroupOutput").inputs[0])
    noise, ramp, coat = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "ValToRGB", "ValToRGB"))
    ramp.color_ramp.elements.new(0.25).color = (0.2, 0.4, 0.6, 0.5)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree, node.label = group, "Wash, thin"
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    tree.links.new(noise.outputs[0], coat.inputs[0])
    tree.links.new(ramp.outputs["Color"], node.inputs["Under"])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Roughness"])
    tree.links.new(coat.outputs["Color"], shader.inputs["Coat Roughness"])
    tree.links.new(node.outputs[0], shader.inputs["Base Color"])
    other = bpy.data.materials.new("Other")
    if other.node_tree is None:
        other.use_nodes = True
    bpy.data.materials["Other"].node_tree.nodes.new("ShaderNodeGroup").node_tree = group
    return SimpleNamespace(
        bpy=bpy, material=material, ramp=ramp, coat=coat, noise=noise, node=node, group=group, shader=shader
    )
