# SPDX-License-Identifier: Apache-2.0
"""Highlights that are turned about an axis of the object, also where the camera does not look. Oracle: Cycles."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from mfo_backend.scene.ply_file import check_ply  # noqa: E402

from ..materials.test_node_graphs import principled  # noqa: E402
from ..scene.test_light_paths import picture_of, scene_reference  # noqa: E402
from ..scenes import add_camera, add_light, add_quad, new_material  # noqa: E402

STEEL = {"Base_Color": (0.7, 0.65, 0.6), "Metallic": 1.0, "Roughness": 0.6, "Anisotropic": 0.9}


def steel(axis: str = "", *, nodes: bool = False) -> Any:
    """Brushed metal whose tangents circle an axis, Cycles' own without one; with a colour by `nodes` it is baked."""
    material = new_material("Steel", **STEEL)
    tree, shader = material.node_tree, principled(material)
    if axis:
        turned = tree.nodes.new("ShaderNodeTangent")
        turned.direction_type, turned.axis = "RADIAL", axis
        tree.links.new(turned.outputs[0], shader.inputs["Tangent"])
    if nodes:
        ramp = tree.nodes.new("ShaderNodeValToRGB")
        for element in ramp.color_ramp.elements:
            element.color = (*STEEL["Base_Color"], 1.0)
        tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], ramp.inputs[0])
        tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    return material


def cup(material: Any) -> Any:
    """A pipe that stands oblique, into which the camera looks: most of its light it has from its own inside."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=32, end_fill_type="NOTHING", depth=1.6)
    item = bpy.context.object
    bpy.ops.object.shade_smooth()
    item.data.uv_layers.remove(item.data.uv_layers[0])
    item.data.materials.append(material)
    item.rotation_euler, item.scale = (0.3, 0.2, 0.5), (1.0, 0.8, 1.0)
    return item


def light_it(scene: Any) -> Any:
    """A lamp that shines into the cup, the camera, and something dark beside; returns that."""
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.cycles.samples = 1024
    scene.cycles.glossy_bounces = scene.cycles.max_bounces = 6
    add_camera("ORTHO", (0.0, -3.0, 4.0), (0.65, 0.0, 0.0), ortho_scale=2.6)
    add_light("AREA", (0.5, 0.3, 4.0), energy=150.0, size=3.0)
    beside = add_quad("Beside", 0.2, 0.1, new_material("Beside", Base_Color=(0.05, 0.05, 0.05), Roughness=0.8))
    beside.location = (1.15, 0.2, 0.0)
    return beside


@pytest.mark.parametrize("axis", ["", "X", "Y"], ids=["own", "X", "Y"])
@pytest.mark.parametrize("kind", ["target", "other", "baked"])
def test_turned_highlights_are_as_in_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, kind: str, axis: str
) -> None:
    beside = light_it(scene)
    item = cup(steel(axis, nodes=kind == "baked"))
    wanted = render_cycles()
    report = export(item if kind == "target" else beside, reference=scene_reference(wanted))
    assert not [note for note in report.notes if "Tangent" in note or "anisotropy" in note]
    assert "graph" not in report.request  # no node is evaluated for it
    # two renders by Cycles are 0.2 to 1.3 % apart; with the frames of single faces it is 45 times as bright about its
    # own axis, +31 % about X and -41 % about Y, baked -97 and -99 % about these two
    assert picture_of(report, 16).mean() / wanted.mean() == pytest.approx(1.0, abs=0.03)


def test_a_deformed_target_is_evaluated_and_another_is_named(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    beside = light_it(scene)
    item = cup(steel())
    cast = item.modifiers.new("Cast", "CAST")
    cast.factor = 0.3
    wanted = render_cycles()
    assert "graph" in export(item, reference=scene_reference(wanted)).request
    said = export(beside, reference=scene_reference(wanted)).notes
    assert [note.split(" turns ")[0] for note in said if "about an axis of 'Cylinder'" in note] == ["Material 'Steel'"]


def test_other_meshes_hold_no_tangents(scene: Any, export: Any) -> None:
    light_it(scene)
    plain = cup(new_material("Plain"))
    report = export(plain)
    of_target, of_other = ((report.folder / f"meshes/{name}.ply").read_bytes() for name in ("target", "shape_0001"))
    assert b"tangent_x" in of_target  # whose anisotropy a fit may find
    assert b"tangent_x" not in of_other
    check_ply(report.folder / "meshes/target.ply")
    tangent = {"value": [0.0] * 3, "linked": False, "mesh": True}
    assert report.request["materials"]["target_bsdf"]["sockets"]["Tangent"] == tangent
