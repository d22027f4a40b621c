# SPDX-License-Identifier: Apache-2.0
"""A way of many Reroutes is walked in steps that do not each look through all links of the tree."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.findings import Findings  # noqa: E402
from blender_addon.export.materials.read_material import read_target  # noqa: E402
from blender_addon.export.nodes.target_shader import target_shader  # noqa: E402
from blender_addon.graph_values.table import graph_values  # noqa: E402
from blender_addon.probe.closure_tree import ClosureTree  # noqa: E402
from blender_addon.probe.graph_copy import own_copy, remove_copy  # noqa: E402

from ..scenes import new_material  # noqa: E402
from .test_graph_findings import chain  # noqa: E402


def rerouted(tree: Any, output: Any, count: int) -> Any:
    return chain(tree, output, count, "NodeReroute")


def looks(count: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """How often a socket is asked for its links, for which Blender looks through the tree, on ways of so many steps:
    before a value, within a group before its input, and before a mix's factor and shader."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    material = new_material("Target")
    tree = material.node_tree
    output = tree.get_output_node("CYCLES").inputs["Surface"]
    shader = output.links[0].from_node
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Roughness", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner = group.nodes.new("ShaderNodeBsdfPrincipled")
    ways = [(group, group.nodes.new("NodeGroupInput").outputs[0], inner.inputs["Roughness"])]
    ways.append((group, inner.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0]))
    node, mix = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeMixShader")
    node.node_tree = group
    ways.append((tree, tree.nodes.new("ShaderNodeTexNoise").outputs[0], mix.inputs[0]))
    ways += [(tree, node.outputs[0], mix.inputs[1]), (tree, shader.outputs[0], mix.inputs[2])]
    ways += [(tree, mix.outputs[0], output)]
    ways += [(tree, tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], shader.inputs["Base Color"])]
    for where, begin, end in ways:
        where.links.new(rerouted(where, begin, count), end)
    asked = 0
    links = bpy.types.NodeSocket.links

    def counted(socket: Any) -> Any:
        nonlocal asked
        asked += 1
        return links.fget(socket)

    with monkeypatch.context() as patch:
        patch.setattr(bpy.types.NodeSocket, "links", property(counted))
        target = target_shader(material, "Principled BSDF")
        assert target is not None
        assert "Noise Texture.001/Scale" in [value.name for value in graph_values(target)]
        findings = Findings()
        assert read_target(material, "Target", 0, findings) is not None
        assert findings.errors == []
        for leaf in target_shader(material, "Group/Principled BSDF"), target:
            assert leaf is not None
            assert leaf.places
        copy = own_copy(material)
        assert len(ClosureTree(copy.node_tree).leaves) == 2
        remove_copy(copy)
    return asked


def test_longer_ways_are_not_looked_through_more_often(monkeypatch: pytest.MonkeyPatch) -> None:
    assert looks(12, monkeypatch) == looks(3, monkeypatch) > 0
