# SPDX-License-Identifier: Apache-2.0
"""Surfaces whose nodes tell the front from the back: what Cycles shows from behind is what is baked of the back."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from ..scene.test_baked_surfaces import Nodes
from ..scenes import add_camera, add_light, add_quad, new_material

KINDS = ["Backfacing", "Normal", "True Normal", "Normal of the object", "BOX"]


def tell_sides(material: Any, kind: str) -> None:
    """A colour that is another on the back."""
    nodes = Nodes(material)
    link = nodes.tree.links.new
    if kind == "BOX":
        node = nodes.new("TexImage")
        node.image = bpy.data.images.new("Halves", 2, 2)
        node.image.pixels = [0.9, 0.2, 0.1, 1.0, 0.1, 0.3, 0.9, 1.0] * 2
        node.image.pack()
        node.projection, node.interpolation = "BOX", "Closest"
        link(node.outputs[0], nodes.principled.inputs["Base Color"])
        return
    half = nodes.place().node
    where = nodes.new("TexCoord").outputs["Normal"] if kind.endswith("object") else None
    link(where or nodes.new("NewGeometry").outputs[kind], half.inputs[0])
    link(half.outputs[0], nodes.principled.inputs["Base Color"])


def looks(report: Any) -> int:
    """How many surfaces have another look from behind."""
    return (report.folder / "scene.xml").read_text("utf-8").count('name="behind"')


def lit(scene: Any) -> Any:
    """A target in a corner of the picture, whose other corner the tests look at."""
    scene.cycles.samples = 256
    add_camera("ORTHO", ortho_scale=4.0)
    add_light("SUN", rotation=(0.0, 0.5, 0.3), energy=3.0)
    target = add_quad("Target", 0.5, 1.0, new_material("Target"))
    target.location = (1.5, -1.5, 0.0)
    return target


@pytest.mark.parametrize("is_behind", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_a_floor_that_is_seen_from_behind(scene: Any, in_both: Any, kind: str, is_behind: bool) -> None:
    target, floor = lit(scene), add_quad("Floor", 4.0, 0.0, new_material("Floor"))
    uv = floor.data.uv_layers.new(name="UVMap")
    uv.uv.foreach_set("vector", np.float32([0.1, 0.2, 0.8, 0.2, 0.8, 0.9, 0.1, 0.9]))
    tell_sides(floor.data.materials[0], kind)
    if is_behind:
        floor.data.flip_normals()
    report, ours, theirs = in_both(target)
    assert looks(report) == 1
    assert ours[:16].mean(axis=(0, 1)) == pytest.approx(theirs[:16].mean(axis=(0, 1)), rel=0.01)
    assert not any("Backfacing" in note for note in report.notes)


@pytest.mark.parametrize("is_clear", [False, True])
def test_the_back_of_a_box_is_baked_where_light_gets_in(scene: Any, in_both: Any, is_clear: bool) -> None:
    target = lit(scene)
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(-0.5, 0.5, -1.0))
    box = bpy.context.object
    box.data.materials.append(new_material("Box", Alpha=0.5 if is_clear else 1.0))
    tell_sides(box.data.materials[0], "Backfacing")
    report, ours, theirs = in_both(target)
    assert looks(report) == is_clear
    assert ours[:16].mean(axis=(0, 1)) == pytest.approx(theirs[:16].mean(axis=(0, 1)), rel=0.015)


@pytest.mark.parametrize(("method", "is_bent"), [("RANDOM_WALK", False), ("RANDOM_WALK", True), ("BURLEY", True)])
def test_light_that_walks_below_a_floor_matters_more_than_its_back(
    scene: Any, in_both: Any, method: str, is_bent: bool
) -> None:
    """As a Lambert surface that has another back the floor was 11 % too bright.

    Where normals are bent it was 10 % too dark: light left it by normals that leant another way around the floor's own.
    """
    target, floor = lit(scene), add_quad("Floor", 4.0, 0.0, new_material("Floor"))
    material = floor.data.materials[0]
    tell_sides(material, "Normal of the object")
    nodes = Nodes(material)
    for name, value in (("Weight", 1.0), ("Radius", (1.0, 0.4, 0.2)), ("Scale", 0.3)):
        nodes.principled.inputs[f"Subsurface {name}"].default_value = value
    nodes.principled.subsurface_method = method
    if is_bent:
        bent = nodes.new("NormalMap")
        bent.inputs["Color"].default_value = (0.6, 0.5, 0.98, 1.0)
        nodes.tree.links.new(bent.outputs[0], nodes.principled.inputs["Normal"])
    report, ours, theirs = in_both(target)
    assert looks(report) == 0
    assert ours[8:16, 8:16].mean(axis=(0, 1)) == pytest.approx(theirs[8:16, 8:16].mean(axis=(0, 1)), rel=0.02)
    assert any("both sides are as its front is" in note for note in report.notes)


def test_walls_around_the_camera_have_their_backs(scene: Any, export: Any) -> None:
    """A room is a closed box, of which the inside is seen."""
    target = lit(scene)
    bpy.ops.mesh.primitive_cube_add(size=20.0)
    bpy.context.object.data.materials.append(new_material("Walls"))
    tell_sides(bpy.context.object.data.materials[0], "BOX")
    assert looks(export(target)) == 1


def test_a_glow_on_one_side_alone_is_named(scene: Any, export: Any) -> None:
    target, screen = lit(scene), add_quad("Screen", 4.0, 0.0, new_material("Screen", Emission_Strength=1.0))
    tell_sides(screen.data.materials[0], "Backfacing")
    said = "Material 'Screen' asks for Backfacing: in the fit both sides glow as its front does."
    assert said in export(target).notes
