# SPDX-License-Identifier: Apache-2.0
"""What a socket is given by constants, pictures and simple nodes: by the formulas of Blender's manual."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.nodes import shader_graph  # noqa: E402
from blender_addon.export.nodes.shader_graph import UnsupportedNodeError, read_socket  # noqa: E402

from ..scenes import new_material  # noqa: E402

RGB = np.array([0.8, 0.25, 0.05])
LUMINANCE = RGB @ [0.2126, 0.7152, 0.0722]  # ITU-R BT.709


@pytest.fixture
def tree() -> Any:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return new_material("Target").node_tree


def socket(tree: Any, name: str) -> Any:
    return tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node.inputs[name]


def node(tree: Any, kind: str, **links: Any) -> Any:
    """A node with outputs, or values, on its inputs."""
    made = tree.nodes.new(f"ShaderNode{kind}")
    for name, given in links.items():
        entry = made.inputs[int(name[1:]) if name[1:].isdigit() else name]
        if isinstance(given, bpy.types.NodeSocket):
            tree.links.new(given, entry)
        else:
            entry.default_value = given
    return made


def constant(tree: Any) -> Any:
    made = node(tree, "RGB").outputs[0]
    made.default_value = (*RGB, 1.0)
    return made


def picture(tree: Any) -> Any:
    image = bpy.data.images.new("Picture", 4, 2, float_buffer=True)
    image.pixels.foreach_set(np.tile(np.float32([*RGB, 1.0]), 8))
    made = node(tree, "TexImage")
    made.image = image
    return made.outputs["Color"]


def math(operation: str, second: float) -> Callable[[Any, Any], Any]:
    def build(tree: Any, source: Any) -> Any:
        made = node(tree, "Math", _0=source, _1=second)
        made.operation = operation
        return made.outputs[0]

    return build


@pytest.mark.parametrize("source", [constant, picture])
@pytest.mark.parametrize(
    ("build", "wanted"),
    [
        (lambda tree, source: node(tree, "Gamma", Color=source, Gamma=2.2).outputs[0], RGB**2.2),
        (lambda tree, source: node(tree, "Invert", _0=0.75, _1=source).outputs[0], RGB + 0.75 * (1.0 - 2.0 * RGB)),
        (lambda tree, source: node(tree, "RGBToBW", Color=source).outputs[0], [LUMINANCE] * 3),
        (lambda tree, source: node(tree, "SeparateColor", Color=source).outputs[0], [RGB[0]] * 3),
        (lambda tree, source: node(tree, "SeparateColor", Color=source).outputs[1], [RGB[1]] * 3),
        (lambda tree, source: node(tree, "SeparateColor", Color=source).outputs[2], [RGB[2]] * 3),
        (math("POWER", 3.0), [LUMINANCE**3] * 3),
        (math("DIVIDE", 4.0), [LUMINANCE / 4.0] * 3),
        (math("DIVIDE", 0.0), [0.0] * 3),
        (math("SUBTRACT", 0.1), [LUMINANCE - 0.1] * 3),
    ],
    ids=["gamma", "invert", "grey", "red", "green", "blue", "power", "quarter", "by zero", "less"],
)
def test_a_node_gives_its_formula(tree: Any, source: Any, build: Any, wanted: Any) -> None:
    tree.links.new(build(tree, source(tree)), socket(tree, "Base Color"))
    found = read_socket(socket(tree, "Base Color"))
    np.testing.assert_allclose(found.value, wanted, rtol=1e-5, atol=1e-7)
    assert (found.texture is not None) is (source is picture)


def mapped(tree: Any, coordinate: str | None, **values: Any) -> Any:
    """What is read of a picture behind a Mapping node."""
    image = picture(tree).node
    mapping = node(tree, "Mapping", **values)
    tree.links.new(mapping.outputs[0], image.inputs["Vector"])
    if coordinate is not None:
        tree.links.new(node(tree, "TexCoord").outputs[coordinate], mapping.inputs["Vector"])
    tree.links.new(image.outputs["Color"], socket(tree, "Base Color"))
    return read_socket(socket(tree, "Base Color"))


def test_a_mapping_scales_turns_and_moves_the_uv(tree: Any) -> None:
    found = mapped(tree, "UV", Location=(0.3, -0.2, 0.0), Rotation=(0.0, 0.0, 0.5), Scale=(2.0, 3.0, 1.0))
    u, v = 0.4, 0.7
    x, y = 2.0 * u, 3.0 * v
    wanted = [x * np.cos(0.5) - y * np.sin(0.5) + 0.3, x * np.sin(0.5) + y * np.cos(0.5) - 0.2, 1.0]
    assert found.texture is not None
    np.testing.assert_allclose(found.texture.uv_matrix @ [u, v, 1.0], wanted, atol=1e-6)


@pytest.mark.parametrize(
    ("coordinate", "values", "words"),
    [
        ("UV", {"Rotation": (0.2, 0.0, 0.0)}, "with a rotation about X or Y"),
        ("UV", {"Rotation": (0.0, 0.2, 0.0)}, "with a rotation about X or Y"),
        ("Generated", {}, "the coordinate 'Generated' of the node 'Texture Coordinate'"),
        (None, {}, "without a texture coordinate"),
    ],
)
def test_other_coordinates_are_refused(tree: Any, coordinate: str | None, values: Any, words: str) -> None:
    with pytest.raises(UnsupportedNodeError, match=words):
        mapped(tree, coordinate, **values)


def test_ways_of_many_nodes_are_left_to_cycles(tree: Any) -> None:
    last = constant(tree)
    for _ in range(shader_graph.MOST_NODES - 1):
        last = node(tree, "Invert", Color=last).outputs[0]
    tree.links.new(last, socket(tree, "Base Color"))
    np.testing.assert_allclose(read_socket(socket(tree, "Base Color")).value, 1.0 - RGB, rtol=1e-5)
    tree.links.new(node(tree, "Invert", Color=last).outputs[0], socket(tree, "Base Color"))
    with pytest.raises(UnsupportedNodeError, match="among more than 32"):
        read_socket(socket(tree, "Base Color"))
