# SPDX-License-Identifier: Apache-2.0
"""Graphs that cannot be evaluated are refused in one sentence before a second Blender starts."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.job import check_export  # noqa: E402

from ..scenes import add_camera, add_quad, new_material, world_color  # noqa: E402

Tree = Any


def empty_group(tree: Tree) -> Any:
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    node.node_tree.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    return node.outputs[0]


def circle(tree: Tree) -> Any:
    first, second = (tree.nodes.new("ShaderNodeMath") for _ in range(2))
    tree.links.new(first.outputs[0], second.inputs[0])
    tree.links.new(second.outputs[0], first.inputs[0])
    return first.outputs[0]


def script(tree: Tree) -> Any:
    node = tree.nodes.new("ShaderNodeScript")
    return node.outputs.new("NodeSocketFloat", "Value")


def unsaved_picture(tree: Tree) -> Any:
    image = bpy.data.images.new("Painted", 4, 4)
    image.pixels[0] = 0.5
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.projection = image, "BOX"
    return node.outputs[0]


def inside_a_group(tree: Tree) -> Any:
    """A circle two groups down."""
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    output = inner.nodes.new("NodeGroupOutput")
    inner.links.new(circle(inner), output.inputs[0])
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    outer.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    node = outer.nodes.new("ShaderNodeGroup")
    node.node_tree = inner
    outer.links.new(node.outputs[0], outer.nodes.new("NodeGroupOutput").inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = outer
    return node.outputs[0]


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (empty_group, "the group 'Empty' without an output"),
        (circle, "by a link in a circle"),
        (inside_a_group, "by a link in a circle"),
        (script, "the script 'Script', which is not evaluated"),
        (unsaved_picture, "the image 'Painted' with changes that are not saved (save or pack it)"),
    ],
)
def test_one_sentence(scene: Any, build: Callable[[Tree], Any], words: str) -> None:
    world_color(scene, 1.0)
    material = new_material("Target")
    tree = material.node_tree
    principled = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    add_camera("ORTHO", ortho_scale=2.0)
    tree.links.new(build(tree), principled.inputs["Roughness"])
    errors, _ = check_export(bpy.context, add_quad("Target", 1.0, 0.0, material))
    assert len(errors) == 1
    assert errors[0].startswith("Roughness of material 'Target' is linked to ")
    assert errors[0].endswith(f"{words}: mend or unlink it.")


def test_a_node_of_another_blender(scene: Any) -> None:
    class Later(bpy.types.ShaderNode):
        bl_idname, bl_label = "ShaderNodeOfLater", "Later"

        def init(self, _context: Any) -> None:
            self.outputs.new("NodeSocketFloat", "Value")

    world_color(scene, 1.0)
    material = new_material("Target")
    tree = material.node_tree
    principled = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    bpy.utils.register_class(Later)
    tree.links.new(tree.nodes.new("ShaderNodeOfLater").outputs[0], principled.inputs["Roughness"])
    bpy.utils.unregister_class(Later)
    add_camera("ORTHO", ortho_scale=2.0)
    errors, _ = check_export(bpy.context, add_quad("Target", 1.0, 0.0, material))
    assert len(errors) == 1
    assert "which this Blender does not know" in errors[0]


def chain(tree: Tree, output: Any, length: int, kind: str = "ShaderNodeMath") -> Any:
    """Nodes one after the other."""
    for _ in range(length):
        node = tree.nodes.new(kind)
        tree.links.new(output, node.inputs[0])
        output = node.outputs[0]
    return output


def lattice(tree: Tree, output: Any, length: int) -> Any:
    """Maths whose number of ways doubles with each step."""
    for _ in range(length):
        node = tree.nodes.new("ShaderNodeMath")
        for socket in list(node.inputs)[:2]:
            tree.links.new(output, socket)
        output = node.outputs[0]
    return output


@pytest.mark.parametrize(
    ("build", "length", "is_broken"), [(chain, 250, True), (lattice, 60, False), (lattice, 60, True)]
)
def test_a_graph_may_have_any_depth(scene: Any, build: Any, length: int, is_broken: bool) -> None:
    """Longer than Python's stack, and with more ways than can be walked one by one."""
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    material = new_material("Target")
    tree = material.node_tree
    first = circle(tree) if is_broken else tree.nodes.new("ShaderNodeTexNoise").outputs[0]
    node = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    tree.links.new(build(tree, first, length), node.inputs["Roughness"])
    target, limit = add_quad("Target", 2.0, 0.0, material), sys.getrecursionlimit()
    try:  # Blender takes seconds to link the thousand nodes that the usual limit is
        sys.setrecursionlimit(len(inspect.stack()) + 200)
        errors, _ = check_export(bpy.context, target)
    finally:
        sys.setrecursionlimit(limit)
    assert [("in a circle" in error) for error in errors] == [True] * is_broken


def test_a_shader_linked_to_a_value_is_left_out_as_in_cycles(scene: Any, export: Any) -> None:
    """The socket keeps its own value, which is not fitted: what is linked is not written."""
    world_color(scene, 1.0)
    material = new_material("Target", Base_Color=(0.2, 0.4, 0.3))
    tree = material.node_tree
    principled = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    add_camera("ORTHO", ortho_scale=2.0)
    tree.links.new(tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], principled.inputs["Base Color"])
    report = export(add_quad("Target", 1.0, 0.0, material))
    color = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]
    assert color["linked"]
    assert color["value"] == pytest.approx([0.2, 0.4, 0.3])


@pytest.mark.parametrize("in_pixels", [True, False])
def test_lines_as_wide_as_pixels_are_named(in_pixels: bool, scene: Any) -> None:
    """A ball with lines of one pixel was 24 % too dark in silence."""
    material = new_material("Lines")
    tree = material.node_tree
    lines = tree.nodes.new("ShaderNodeWireframe")
    lines.use_pixel_size = in_pixels
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(lines.outputs[0], shader.inputs["Base Color"])
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    _, notes = check_export(bpy.context, add_quad("Target", 1.0, 0.0, material))
    assert any("'Wireframe' measures in pixels" in note for note in notes) == in_pixels
