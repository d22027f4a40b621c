# SPDX-License-Identifier: Apache-2.0
"""The leaves of a mix and their weights, by the rules of Mix and Add Shader."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.probe.closure_tree import ClosureTree  # noqa: E402


@pytest.fixture
def tree() -> Any:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    material = bpy.data.materials.new("Target")
    if material.node_tree is None:
        material.use_nodes = True
    for node in [n for n in material.node_tree.nodes if n.bl_idname != "ShaderNodeOutputMaterial"]:
        material.node_tree.nodes.remove(node)
    return material.node_tree


def shader(tree: Any, kind: str) -> Any:
    return tree.nodes.new(f"ShaderNode{kind}").outputs[0]


def mixed(tree: Any, first: Any, second: Any, factor: Any = None) -> Any:
    """A mix by a factor, or a sum."""
    node = tree.nodes.new("ShaderNodeAddShader" if factor is None else "ShaderNodeMixShader")
    for output, socket in zip((first, second), node.inputs if factor is None else node.inputs[1:], strict=True):
        tree.links.new(output, socket)
    if isinstance(factor, float):
        node.inputs[0].default_value = factor
    elif factor is not None:
        tree.links.new(factor, node.inputs[0])
    return node.outputs[0]


def weights(tree: Any, surface: Any) -> list[tuple[str, Any]]:
    tree.links.new(surface, tree.get_output_node("CYCLES").inputs["Surface"])
    return [(leaf.node.bl_idname.removeprefix("ShaderNode"), leaf.weight) for leaf in ClosureTree(tree).leaves]


def test_numbers_are_multiplied_down_to_the_leaves(tree: Any) -> None:
    glossy = mixed(tree, shader(tree, "BsdfTranslucent"), shader(tree, "BsdfGlass"), 0.25)
    surface = mixed(tree, mixed(tree, shader(tree, "BsdfDiffuse"), shader(tree, "Emission")), glossy, 0.4)
    wanted = {"BsdfDiffuse": 0.6, "Emission": 0.6, "BsdfTranslucent": 0.4 * 0.75, "BsdfGlass": 0.4 * 0.25}
    assert dict(weights(tree, surface)) == pytest.approx(wanted)


def test_a_factor_is_clamped_and_what_has_no_weight_is_no_leaf(tree: Any) -> None:
    node = mixed(tree, shader(tree, "BsdfDiffuse"), shader(tree, "BsdfTranslucent"), 0.0)
    assert weights(tree, node) == [("BsdfDiffuse", 1.0)]
    node.node.inputs[0].default_value = 1.5
    assert weights(tree, node) == [("BsdfTranslucent", 1.0)]


def worth(socket: Any) -> float:
    """What a Math node of the tree gives, and a Value node."""
    node = socket.node
    if node.bl_idname == "ShaderNodeValue":
        return node.outputs[0].default_value
    a, b = (worth(i.links[0].from_socket) if i.is_linked else i.default_value for i in list(node.inputs)[:2])
    found = {"ADD": a + b, "SUBTRACT": a - b, "MULTIPLY": a * b}[node.operation]
    return min(max(found, 0.0), 1.0) if node.use_clamp else found


@pytest.mark.parametrize(("given", "clamped"), [(0.3, 0.3), (1.7, 1.0), (-0.2, 0.0)])
def test_a_linked_factor_becomes_nodes_of_the_same_worth(tree: Any, given: float, clamped: float) -> None:
    value = shader(tree, "Value")
    value.default_value = given
    inner = mixed(tree, shader(tree, "BsdfTranslucent"), shader(tree, "BsdfGlass"), 0.25)
    found = weights(tree, mixed(tree, shader(tree, "BsdfDiffuse"), inner, value))
    wanted = {"BsdfDiffuse": 1.0 - clamped, "BsdfTranslucent": 0.75 * clamped, "BsdfGlass": 0.25 * clamped}
    assert {name: worth(weight) for name, weight in found} == pytest.approx(wanted, abs=1e-6)
