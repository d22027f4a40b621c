# SPDX-License-Identifier: Apache-2.0
"""The recorded picture of a bare Diffuse BSDF, and of one and a Principled BSDF inside groups, against Cycles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.findings import ExportError, Findings  # noqa: E402
from blender_addon.export.materials.read_context import read_context  # noqa: E402
from blender_addon.export.materials.read_material import read_target  # noqa: E402
from blender_addon.export.nodes.leaf_kinds import KINDS, is_fitted  # noqa: E402
from blender_addon.versions import has_diffuse_roughness  # noqa: E402

from ..scenes import diffuse_material, new_material  # noqa: E402
from .test_node_graphs import ball, lit_scene, noise_ramp, principled, recorded_and_cycles  # noqa: E402


def grouped(material: Any, linked: str) -> Any:
    """The material with its shader two groups deep, and Generated coordinates through both groups on a socket."""
    shader = principled(material)
    tree, output = material.node_tree, material.node_tree.get_output_node("CYCLES")
    values = {s.identifier: s.default_value for s in shader.inputs if s.type in ("VALUE", "RGBA")}
    kept = {name: tuple(v) if hasattr(v, "__len__") else v for name, v in values.items()}
    kind, inside = shader.bl_idname, None
    for name in ("Inner", "Outer"):
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        group.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketVector")
        group.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
        node = group.nodes.new(kind if inside is None else "ShaderNodeGroup")
        if inside is None:
            for socket in node.inputs:
                if socket.identifier in kept:
                    socket.default_value = kept[socket.identifier]
        else:
            node.node_tree = inside
        paint = node.inputs[linked if inside is None else "Paint"]
        group.links.new(group.nodes.new("NodeGroupInput").outputs[0], paint)
        group.links.new(node.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
        inside = group
    top = tree.nodes.new("ShaderNodeGroup")
    top.node_tree = inside
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], top.inputs["Paint"])
    tree.links.new(top.outputs[0], output.inputs["Surface"])
    return material


def rough_diffuse() -> Any:
    material = diffuse_material("Target", (0.6, 0.3, 0.2))
    principled(material).inputs["Roughness"].default_value = 0.8
    return material


def painted_diffuse() -> Any:
    material = rough_diffuse()
    node = principled(material)
    twin = type("Twin", (), {"inputs": {"Base Color": node.inputs["Color"]}})
    noise_ramp(material.node_tree, twin)
    return material


def glossy_in_groups() -> Any:
    return grouped(
        new_material("Target", Metallic=0.5, Roughness=0.4, Coat_Weight=0.5, Coat_Roughness=0.3), "Base Color"
    )


def diffuse_in_groups() -> Any:
    return grouped(rough_diffuse(), "Color")


@pytest.mark.parametrize("build", [rough_diffuse, painted_diffuse, glossy_in_groups, diffuse_in_groups])
def test_the_recorded_picture_is_cycles(scene: Any, export: Any, render_cycles: Any, mitsuba: Any, build: Any) -> None:
    if "diffuse" in build.__name__ and not has_diffuse_roughness():
        pytest.skip("the rough Diffuse BSDF of Blender 4.2 is named, and shown as a smooth one")
    lit_scene(scene)
    found, truth = recorded_and_cycles(export, render_cycles, ball(build()))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.003
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < 0.01


def test_a_shader_without_a_value_to_fit_is_refused_by_its_names(scene: Any, export: Any) -> None:
    lit_scene(scene)
    material = rough_diffuse()
    node, tree = principled(material), material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeRGB").outputs[0], node.inputs["Color"])
    tree.links.new(tree.nodes.new("ShaderNodeValue").outputs[0], node.inputs["Roughness"])
    with pytest.raises(ExportError) as caught:
        export(ball(material), fit={"parameters": "reduced"})  # which takes no value of the nodes
    own = "Color (base_color) and Roughness (diffuse_roughness)" if has_diffuse_roughness() else "Color (base_color)"
    assert str(caught.value) == (
        f"A Diffuse BSDF has {own} alone, and none of them is left to fit: choose one that has no link."
    )


def settings_of_shaders() -> list[tuple[str, str, str]]:
    """Every choice of every menu of a shader node that is fitted or held."""
    tree = bpy.data.materials.new("Menus").node_tree or bpy.data.node_groups.new("Menus", "ShaderNodeTree")
    found = []
    for kind in (kind for kind in KINDS if hasattr(bpy.types, kind)):  # 4.2 has no Metallic BSDF
        node = tree.nodes.new(kind)
        own = (p for p in node.bl_rna.properties if p.identifier not in bpy.types.Node.bl_rna.properties)
        found += [(kind, p.identifier, item) for p in own if p.type == "ENUM" for item in p.enum_items.keys()]  # noqa: SIM118
    return found


@pytest.mark.parametrize(("kind", "setting", "choice"), settings_of_shaders())
def test_a_socket_that_a_setting_hides_is_read(scene: Any, kind: str, setting: str, choice: str) -> None:
    """As the target, as a held part of a mix, and on another object."""
    material = new_material("Target")
    tree, first, mix = material.node_tree, principled(material), material.node_tree.nodes.new("ShaderNodeMixShader")
    node, output = tree.nodes.new(kind), tree.get_output_node("CYCLES").inputs["Surface"]
    setattr(node, setting, choice)
    shader = node.outputs[0]
    tree.links.new(shader, output)
    findings = Findings()
    alone = read_target(material, "Ball", 0, findings)
    assert (alone is None) == (not is_fitted(node))
    assert read_context(material, "Ball", findings).sockets
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(shader, mix.inputs[2])
    tree.links.new(mix.outputs[0], output)
    both = read_target(material, "Ball", 0, Findings())
    assert both is not None
    assert len(both.leaves) == 1


def test_a_metal_by_index_and_extinction_has_both_and_their_colour(scene: Any) -> None:
    """The colour is for Mitsuba's own model, which knows no index."""
    if not hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        pytest.skip("Blender 4.2 has no Metallic BSDF")
    material = new_material("Gold")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeBsdfMetallic")
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    n, k = np.array([0.18, 0.42, 1.37]), np.array([3.42, 2.35, 1.77])
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = n, k
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    found = read_context(material, "Ring", Findings())
    assert found.shader == "conductor"
    np.testing.assert_allclose(found.sockets["Metal IOR"].value, n, rtol=1e-6)
    np.testing.assert_allclose(found.sockets["Metal Extinction"].value, k, rtol=1e-6)
    np.testing.assert_allclose(
        found.sockets["Base Color"].value, ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2), rtol=1e-5
    )


def test_a_colour_in_the_place_of_a_shader_alone_is_said(scene: Any) -> None:
    """It reflects no light."""
    material = new_material("Toon")
    tree = material.node_tree
    ramp, output = tree.nodes.new("ShaderNodeValToRGB"), tree.get_output_node("CYCLES").inputs["Surface"]
    tree.links.new(ramp.outputs[0], output)
    findings = Findings()
    assert read_target(material, "Ball", 0, findings) is None
    (error,) = findings.errors
    assert error.startswith("Material 'Toon' shows Color Ramp alone, which reflects no light: link a Principled BSDF")


@pytest.mark.parametrize("linked", ["Anisotropy", "Rotation"])
def test_the_socket_of_a_glossy_bsdf_that_is_left_out_is_named(scene: Any, linked: str) -> None:
    material = new_material("Brushed")
    tree, output = material.node_tree, material.node_tree.get_output_node("CYCLES")
    node = tree.nodes.new("ShaderNodeBsdfAnisotropic")
    node.inputs["Anisotropy"].default_value = 0.5
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], node.inputs[linked])
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    findings = Findings()
    read_target(material, "Pan", 0, findings)
    assert [note for note in findings.notes if "left out" in note] == [
        f"Material 'Brushed': what is linked to {linked} of '{node.name}' is left out."
    ]


def test_a_mix_whose_other_shader_cannot_be_fitted_says_so(scene: Any) -> None:
    """Of a pane's Glass BSDF nothing can be chosen; where both scatter light the other may be."""
    for kind, said in (
        ("Glass", "is held, for 'Glass BSDF' lets light through."),
        ("Translucent", "is chosen."),
        ("Glossy", "is chosen."),
    ):
        material = new_material("Target")
        tree = material.node_tree
        mix, other = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new(f"ShaderNodeBsdf{kind}")
        tree.links.new(principled(material).outputs[0], mix.inputs[1])
        tree.links.new(other.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
        findings = Findings()
        read_target(material, "Ball", 0, findings)
        assert any(note.endswith(said) and "mixes shaders" in note for note in map(str, findings.notes)), kind
