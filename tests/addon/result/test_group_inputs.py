# SPDX-License-Identifier: Apache-2.0
"""Inputs of node groups, which are the settings that they feed inside."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest


@pytest.mark.parametrize(
    ("fed", "lower", "upper", "kind", "scanned"),
    [
        (("ShaderNodeBump", "Strength"), 0.0, 1.0, "setting", True),
        (("ShaderNodeHueSaturation", "Hue"), 0.0, 1.0, "setting", False),
        (("ShaderNodeTexNoise", "Scale"), 0.5, 8.0, "number", True),
        (("ShaderNodeMath", "Value"), 0.0, 4.0, "setting", False),
    ],
    ids=lambda each: each[1] if isinstance(each, tuple) else "",
)
def test_an_input_is_what_it_feeds_inside(
    fed: tuple[str, str], lower: float, upper: float, kind: str, scanned: bool, scene: SimpleNamespace
) -> None:
    """Through two groups, whatever it is called there."""
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.table import graph_values

    bpy = scene.bpy
    material = bpy.data.materials["Glaze"]
    tree: Any = material.node_tree
    outer, inner = (bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("Outer", "Inner"))
    for group in (outer, inner):
        group.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
        group.interface.new_socket("Given", in_out="OUTPUT", socket_type="NodeSocketColor")
    nested = outer.nodes.new("ShaderNodeGroup")
    nested.node_tree = inner
    for group, node, name in ((inner, inner.nodes.new(fed[0]), fed[1]), (outer, nested, "Amount")):
        group.links.new(group.nodes.new("NodeGroupInput").outputs[0], node.inputs[name])
        group.links.new(node.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree, node.label = outer, "Finish"
    node.inputs["Amount"].default_value = 2.0 if lower or upper > 1.0 else 0.2
    shown = tree.nodes["Principled BSDF"].inputs["Normal" if fed[0] == "ShaderNodeBump" else "Base Color"]
    tree.links.new(node.outputs[0], shown)
    target = target_shader(material)
    assert target is not None
    found = {value.name: value.range for value in graph_values(target)}["Finish/Amount"]
    assert (found.lower, found.upper, found.group, found.scanned) == (lower, upper, kind, scanned)
