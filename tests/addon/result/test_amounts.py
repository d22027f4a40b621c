# SPDX-License-Identifier: Apache-2.0
"""Numbers inside nodes that are what a socket gets, or a part of it: *All* takes them, as it takes colours."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest


def taken(material: Any) -> dict[str, tuple[float, float]]:
    """The names that *All* takes, with their ranges."""
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.mix_values import default_values

    target = target_shader(material)
    assert target is not None
    return {v.name: (v.range.lower, v.range.upper) for v in default_values(target, all_leaves=False)}


@pytest.fixture
def nodes(scene: SimpleNamespace) -> SimpleNamespace:
    material = scene.bpy.data.materials["Glaze"]
    tree: Any = material.node_tree

    def new(kind: str, **settings: Any) -> Any:
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    shader = tree.nodes["Principled BSDF"]
    noise = new("TexNoise")
    return SimpleNamespace(
        bpy=scene.bpy, material=material, tree=tree, new=new, shader=shader, noise=noise, link=tree.links.new
    )


def test_what_a_map_range_gives(nodes: SimpleNamespace) -> None:
    """Its other limits say where on the noise that is, and are named by the user."""
    node = nodes.new("MapRange")
    nodes.link(nodes.noise.outputs[0], node.inputs["Value"])
    nodes.link(node.outputs[0], nodes.shader.inputs["Roughness"])
    assert taken(nodes.material) == {"Map Range/To Min": (0.0, 1.0), "Map Range/To Max": (0.0, 1.0)}
    node.inputs["To Max"].default_value = 3.0
    assert taken(nodes.material)["Map Range/To Max"] == (0.0, 6.0)


def test_what_passes_sums_and_products(nodes: SimpleNamespace) -> None:
    """Math nodes hand on what is one, and have none themselves: a picture with a factor stays a picture."""
    node, clamp = nodes.new("MapRange"), nodes.new("Clamp")
    times, plus = nodes.new("Math", operation="MULTIPLY"), nodes.new("Math", operation="ADD")
    times.label, plus.label = "Times", "Plus"
    nodes.link(nodes.noise.outputs[0], node.inputs["Value"])
    nodes.link(node.outputs[0], times.inputs[0])
    nodes.link(times.outputs[0], plus.inputs[0])
    nodes.link(plus.outputs[0], clamp.inputs["Value"])
    nodes.link(clamp.outputs[0], nodes.shader.inputs["Metallic"])
    assert set(taken(nodes.material)) == {"Map Range/To Min", "Map Range/To Max"}
    times.operation = "POWER"
    assert taken(nodes.material) == {}


@pytest.mark.parametrize(("operation", "limits"), [("MULTIPLY", (0.0, 2.0)), ("ADD", (-1.0, 1.0))])
def test_the_input_of_a_group_that_adds_or_multiplies(
    nodes: SimpleNamespace, operation: str, limits: tuple[float, float]
) -> None:
    group: Any = nodes.bpy.data.node_groups.new("Wear", "ShaderNodeTree")
    group.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Roughness", in_out="OUTPUT", socket_type="NodeSocketFloat")
    inner, noise = group.nodes.new("ShaderNodeMath"), group.nodes.new("ShaderNodeTexNoise")
    inner.operation = operation
    group.links.new(noise.outputs[0], inner.inputs[0])
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], inner.inputs[1])
    group.links.new(inner.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    outer = nodes.new("Group", node_tree=group)
    outer.inputs["Amount"].default_value = 0.5
    nodes.link(outer.outputs[0], nodes.shader.inputs["Roughness"])
    assert taken(nodes.material) == {"Group/Amount": limits}


def test_a_value_node_and_the_input_of_a_group(nodes: SimpleNamespace) -> None:
    group: Any = nodes.bpy.data.node_groups.new("Wear", "ShaderNodeTree")
    group.interface.new_socket("Worn", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Roughness", in_out="OUTPUT", socket_type="NodeSocketFloat")
    inner = group.nodes.new("ShaderNodeMapRange")
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], inner.inputs["To Max"])
    group.links.new(inner.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    outer = nodes.new("Group", node_tree=group)
    outer.label = "Worn Paint"
    nodes.link(outer.outputs[0], nodes.shader.inputs["Roughness"])
    value = nodes.new("Value")
    nodes.link(value.outputs[0], nodes.shader.inputs["Coat Weight"])
    assert set(taken(nodes.material)) == {"Worn Paint/Worn", "Map Range/To Min", "Value/Value"}


def test_what_a_texture_or_a_normal_gets_is_none(nodes: SimpleNamespace) -> None:
    """A value that is a scale, a place on a ramp or a height has many minima, or none of its own."""
    value, ramp, bump = nodes.new("Value"), nodes.new("ValToRGB"), nodes.new("Bump")
    for socket in (nodes.noise.inputs["Scale"], ramp.inputs[0], bump.inputs["Distance"]):
        nodes.link(value.outputs[0], socket)
    nodes.link(nodes.noise.outputs[0], nodes.shader.inputs["Roughness"])
    nodes.link(ramp.outputs["Color"], nodes.shader.inputs["Coat Weight"])
    nodes.link(bump.outputs[0], nodes.shader.inputs["Normal"])
    assert set(taken(nodes.material)) == {f"{ramp.name}/Stop 0", f"{ramp.name}/Stop 1", "Bump/Strength"}
    nodes.link(value.outputs[0], nodes.shader.inputs["Metallic"])  # here it is what it is, too
    assert "Value/Value" in taken(nodes.material)
