# SPDX-License-Identifier: Apache-2.0
"""Surfaces of nodes: what Cycles bakes is, at every point of the mesh, what the nodes say there."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import bpy
import numpy as np
import pytest

from blender_addon.export.findings import Findings
from blender_addon.export.materials.baked_material import Baked
from blender_addon.export.scene import scene_bakes
from mfo_backend.scene.image_file import read_image

from ..baked_shapes import at_vertices, attribute, read_ply, shape_of, texture
from ..scenes import add_camera, add_quad, new_material, world_color


class Nodes:
    """Nodes of a material in a few words."""

    def __init__(self, material: Any) -> None:
        self.tree = material.node_tree
        self.principled = next(node for node in self.tree.nodes if node.type == "BSDF_PRINCIPLED")
        self.surface = self.tree.get_output_node("CYCLES").inputs["Surface"]

    def new(self, kind: str) -> Any:
        return self.tree.nodes.new(f"ShaderNode{kind}")

    def place(self) -> Any:
        """Half of (x + 1, y + 1, z + 1) in world space."""
        half = self.new("VectorMath")
        half.operation = "MULTIPLY_ADD"
        half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
        self.tree.links.new(self.new("NewGeometry").outputs["Position"], half.inputs[0])
        return half.outputs[0]


@pytest.fixture
def stage(scene: Any) -> tuple[Any, Any, Nodes]:
    """A target, and a turned and scaled ball with a material of nodes: target, ball, nodes."""
    world_color(scene, 1.0)
    scene.render.resolution_x = scene.render.resolution_y = 256  # bakes are about as fine as the picture
    add_camera("ORTHO", ortho_scale=4.0)
    target = add_quad("Target", 1.0, 1.5, new_material("Target"))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, radius=0.5, rotation=(0.4, 0.2, 0.9))
    ball = bpy.context.object
    ball.name, ball.scale = "Ball", (1.0, 1.5, 1.0)
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(new_material("Ball"))
    return target, ball, Nodes(ball.data.materials[0])


def test_sockets_hold_what_their_nodes_say(stage: Any, export: Any) -> None:
    target, ball, nodes = stage
    ball.data.uv_layers.remove(ball.data.uv_layers[0])  # without a map UV is zero, and not that of the bake
    nodes.tree.links.new(nodes.new("TexCoord").outputs["UV"], nodes.principled.inputs["Sheen Tint"])
    place = nodes.place()
    apart, bump = nodes.new("SeparateXYZ"), nodes.new("Bump")
    nodes.tree.links.new(place, apart.inputs[0])
    nodes.tree.links.new(place, nodes.principled.inputs["Base Color"])
    nodes.tree.links.new(bump.outputs[0], nodes.principled.inputs["Coat Normal"])
    for axis, socket in (("X", "Roughness"), ("Y", "Metallic")):
        nodes.tree.links.new(apart.outputs[axis], nodes.principled.inputs[socket])
    blue = nodes.new("RGB")  # a colour on a number, which takes its luminance, and the other way round
    blue.outputs[0].default_value = (0.1, 0.2, 0.9, 1.0)
    nodes.tree.links.new(blue.outputs[0], nodes.principled.inputs["Coat Weight"])
    nodes.tree.links.new(apart.outputs["X"], nodes.principled.inputs["Specular Tint"])
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    expected = 0.5 * positions + 0.5
    # a vertex lies within a texel of its place, and a texel is about a hundredth of the ball wide
    sockets = report.request["materials"][bsdf]["sockets"]
    luminance = 0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.9
    assert sockets["Coat Weight"]["value"] == pytest.approx(luminance, abs=1e-3)
    assert sockets["Sheen Tint"]["value"] == [0.0, 0.0, 0.0]
    grey = np.repeat(expected[:, :1], 3, axis=1)
    for socket, values in (
        ("Base Color", expected),
        ("Roughness", expected[:, :1]),
        ("Metallic", expected[:, 1:2]),
        ("Specular Tint", grey),
    ):
        found = at_vertices(texture(report, bsdf, socket), uv)[:, : values.shape[1]]
        assert np.sqrt(np.mean((found - values) ** 2)) < 0.01, socket
    assert "Material 'Ball': what is linked to Coat Normal is left out." in report.notes
    assert report.request["materials"][bsdf]["sockets"]["IOR"] == {"value": 1.5, "linked": False}


def test_a_material_in_a_later_slot_is_baked_like_one_in_the_first(stage: Any, export: Any) -> None:
    """Two materials of nodes on one ball, half of its faces each."""
    target, ball, nodes = stage
    ball.data.materials.append(new_material("Other"))
    other = Nodes(ball.data.materials[1])
    for each in (nodes, other):
        each.tree.links.new(each.place(), each.principled.inputs["Base Color"])
    count = len(ball.data.polygons)
    ball.data.polygons.foreach_set("material_index", 2 * np.arange(count, dtype=np.int32) // count)
    report = export(target)
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    shapes = [shape for shape in scene.iterfind("shape") if attribute(shape, "ref", "id").startswith("baked")]
    assert len(shapes) == 2
    for shape in shapes:
        positions, uv = read_ply(report.folder / attribute(shape, "string", "value"))
        found = at_vertices(texture(report, attribute(shape, "ref", "id"), "Base Color"), uv)
        assert np.sqrt(np.mean((found - 0.5 * positions - 0.5) ** 2)) < 0.03


def test_instances_have_each_what_is_theirs(
    stage: Any, export: Any, render_cycles: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Place and random number of two of three instances; the third has what the first has, and both are named."""
    monkeypatch.setattr(scene_bakes, "MOST_PLACES", 2)
    target, ball, nodes = stage
    apart, shown, glow = nodes.new("SeparateXYZ"), nodes.new("CombineColor"), nodes.new("Emission")
    place = nodes.place()
    place.node.inputs[1].default_value = (0.25, 0.25, 0.25)  # above zero on all instances
    nodes.tree.links.new(place, apart.inputs[0])
    nodes.tree.links.new(apart.outputs[0], shown.inputs[0])
    nodes.tree.links.new(nodes.new("ObjectInfo").outputs["Random"], shown.inputs[1])
    told = nodes.new("Attribute")
    told.attribute_type, told.attribute_name = "INSTANCER", "wet"
    nodes.tree.links.new(told.outputs["Fac"], shown.inputs[2])
    nodes.tree.links.new(shown.outputs[0], glow.inputs["Color"])
    for socket, black in (("Base Color", (0.0, 0.0, 0.0, 1.0)), ("Specular IOR Level", 0.0)):  # Cycles sees glow alone
        nodes.principled.inputs[socket].default_value = black
    added = nodes.new("AddShader")
    nodes.tree.links.new(nodes.principled.outputs[0], added.inputs[0])
    nodes.tree.links.new(glow.outputs[0], added.inputs[1])
    nodes.tree.links.new(added.outputs[0], nodes.surface)
    prefab = bpy.data.collections.new("Prefab")
    bpy.context.scene.collection.children.link(prefab)
    prefab.objects.link(ball)
    bpy.context.scene.collection.objects.unlink(ball)
    bpy.context.view_layer.layer_collection.children["Prefab"].exclude = True
    for place in ((-1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0)):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", prefab, place
        bpy.context.scene.collection.objects.link(empty)
    report = export(target)
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    picture, found = render_cycles(), []
    for shape in scene.iterfind("shape"):
        bsdf = attribute(shape, "ref", "id")
        if bsdf.startswith("baked"):
            positions, uv = read_ply(report.folder / attribute(shape, "string", "value"))
            color = at_vertices(texture(report, bsdf, "Emission Color"), uv)
            row, column = (np.array([2.0 - positions[:, 1].mean(), 2.0 + positions[:, 0].mean()]) * 64).astype(int)
            found.append((bsdf, picture[row, column], positions, color))
    assert [bsdf for bsdf, *_ in found] == ["baked_0001", "baked_0002", "baked_0001"]
    for _, seen, positions, color in found[:2]:
        assert np.sqrt(np.mean((color[:, 0] - 0.25 * positions[:, 0] - 0.5) ** 2)) < 0.01
        np.testing.assert_allclose(color[:, 1], seen[1], atol=2e-3)
    assert abs(found[0][1][1] - found[1][1][1]) > 0.01  # the numbers of two instances differ
    shared = "may differ between the 2 instances of 'Ball'; all have the bake of the first."
    assert f"Material 'Ball': Geometry, Object Info {shared}" in report.notes
    told_of = "what Attribute tell of each instance of 'Ball' is left out: in the fit it is as of the object alone."
    assert f"Material 'Ball': {told_of}" in report.notes


def test_generated_coordinates_are_those_of_the_object_without_its_modifiers(stage: Any, export: Any) -> None:
    target, ball, nodes = stage
    ball.modifiers.new("Array", "ARRAY").count = 2
    coordinate = nodes.new("TexCoord")
    nodes.tree.links.new(coordinate.outputs["Generated"], nodes.principled.inputs["Base Color"])
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    local = positions @ np.linalg.inv(np.array(ball.matrix_world.to_3x3())).T
    first = local[:, 0] < 0.49  # of the two copies
    found = at_vertices(texture(report, bsdf, "Base Color"), uv)
    assert np.sqrt(np.mean((found[first] - (local[first] + 0.5)) ** 2)) < 0.03  # of the copies together it is 0.25


def test_generated_coordinates_of_a_metaball_are_those_of_its_faces(stage: Any, export: Any) -> None:
    """Its data's own are of another size; a box and a metaball with waves were 1 % off."""
    target, ball, nodes = stage
    blob = bpy.data.metaballs.new("Blob")
    blob.resolution = blob.render_resolution = 0.2
    blob.elements.new().radius = 1.1
    blob.materials.append(ball.data.materials[0])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Blob", blob))
    bpy.data.objects.remove(ball)
    coordinate = nodes.new("TexCoord")
    nodes.tree.links.new(coordinate.outputs["Generated"], nodes.principled.inputs["Base Color"])
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    low, high = positions.min(axis=0), positions.max(axis=0)
    found = at_vertices(texture(report, bsdf, "Base Color"), uv)
    # by its data 0.1; where islands of the map meet a vertex may lie in a texel of the next one
    assert np.median(np.abs(found - (positions - low) / (high - low))) < 0.02


@pytest.mark.parametrize(
    ("modifier", "source", "is_said"),
    [
        ("SIMPLE_DEFORM", "TexCoord", True),
        ("SIMPLE_DEFORM", "TexNoise", True),
        ("SIMPLE_DEFORM", "VertexColor", False),
        ("ARRAY", "TexCoord", False),
    ],
)
def test_generated_coordinates_of_a_deformed_mesh_are_said(
    modifier: str, source: str, is_said: bool, stage: Any
) -> None:
    from blender_addon.export.job import check_export

    target, ball, nodes = stage
    ball.modifiers.new("Bend", modifier)
    mixed = nodes.new("MixRGB")
    nodes.tree.links.new(nodes.new(source).outputs[0], mixed.inputs[1])
    nodes.tree.links.new(mixed.outputs[0], nodes.principled.inputs["Base Color"])
    said = (
        "Material 'Ball' of 'Ball': the bake takes Generated coordinates after the mesh is deformed (Bend), Cycles "
        "before."
    )
    assert (said in check_export(bpy.context, target)[1]) == is_said


def test_shape_keys_deform_too(stage: Any) -> None:
    from blender_addon.export.job import check_export

    target, ball, nodes = stage
    ball.shape_key_add(name="Basis")
    ball.shape_key_add(name="Grown").value = 1.0
    nodes.tree.links.new(nodes.new("TexNoise").outputs[0], nodes.principled.inputs["Roughness"])
    assert any("is deformed (shape keys), Cycles before" in note for note in check_export(bpy.context, target)[1])


def test_mix_in_a_group_becomes_a_blend(stage: Any, export: Any) -> None:
    target, _, nodes = stage
    group = bpy.data.node_groups.new("Mix", "ShaderNodeTree")
    for name, direction in (("First", "INPUT"), ("Factor", "INPUT"), ("Shader", "OUTPUT")):
        kind = "NodeSocketFloat" if name == "Factor" else "NodeSocketShader"
        group.interface.new_socket(name, in_out=direction, socket_type=kind)
    given, out = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    mixed, matte = group.nodes.new("ShaderNodeMixShader"), group.nodes.new("ShaderNodeBsdfDiffuse")
    matte.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    for source, socket in (
        (given.outputs["Factor"], mixed.inputs[0]),
        (given.outputs["First"], mixed.inputs[1]),
        (matte.outputs[0], mixed.inputs[2]),
        (mixed.outputs[0], out.inputs[0]),
    ):
        group.links.new(source, socket)
    node = nodes.new("Group")
    node.node_tree = group
    apart = nodes.new("SeparateXYZ")
    nodes.tree.links.new(nodes.place(), apart.inputs[0])
    nodes.tree.links.new(apart.outputs["X"], node.inputs["Factor"])
    nodes.tree.links.new(nodes.principled.outputs[0], node.inputs["First"])
    nodes.tree.links.new(node.outputs[0], nodes.surface)
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    blend = next(element for element in scene.iterfind("bsdf") if element.get("id") == bsdf)
    assert blend.get("type") == "blendbsdf"
    assert [ref.get("id") for ref in blend.iterfind("ref")] == [f"{bsdf}_0", f"{bsdf}_1"]
    weight = np.asarray(read_image(report.folder / attribute(blend, "texture/string", "value")).pixels)
    found = at_vertices(weight, uv)[:, 0]
    assert np.sqrt(np.mean((found - (0.5 * positions[:, 0] + 0.5)) ** 2)) < 0.01
    sockets = report.request["materials"][f"{bsdf}_1"]["sockets"]
    np.testing.assert_allclose(sockets["Base Color"]["value"], (0.1, 0.2, 0.3), rtol=1e-5)


def test_a_tilted_normal_is_tilted_in_the_frame_of_the_map(stage: Any, export: Any) -> None:
    """The smooth normal turned by a known angle has that angle in the normal map, and a Normal Map of blue has none."""
    target, _, nodes = stage
    turned = nodes.new("VectorMath")
    turned.operation = "ADD"
    geometry, tangent = nodes.new("NewGeometry"), nodes.new("Tangent")
    scaled = nodes.new("VectorMath")
    scaled.operation, scaled.inputs["Scale"].default_value = "SCALE", 0.5
    for source, socket in (
        (tangent.outputs[0], scaled.inputs[0]),
        (geometry.outputs["Normal"], turned.inputs[0]),
        (scaled.outputs[0], turned.inputs[1]),
        (turned.outputs[0], nodes.principled.inputs["Normal"]),
    ):
        nodes.tree.links.new(source, socket)
    report = export(target)
    bsdf, _, uv = shape_of(report)
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    bumped = next(element for element in scene.iterfind("bsdf") if element.get("id") == bsdf)
    assert bumped.get("type") == "normalmap"
    normals = 2.0 * np.asarray(read_image(report.folder / attribute(bumped, "texture/string", "value")).pixels) - 1.0
    found = at_vertices(normals, uv)[:, 2]
    np.testing.assert_allclose(np.median(found), np.cos(np.arctan(0.5)), atol=0.005)


def test_glow_of_any_tree_is_emission(stage: Any, export: Any) -> None:
    target, _, nodes = stage
    glow, added = nodes.new("Emission"), nodes.new("AddShader")
    nodes.tree.links.new(nodes.place(), glow.inputs["Color"])
    glow.inputs["Strength"].default_value = 3.0
    nodes.tree.links.new(nodes.principled.outputs[0], added.inputs[0])
    nodes.tree.links.new(glow.outputs[0], added.inputs[1])
    nodes.tree.links.new(added.outputs[0], nodes.surface)
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    found = at_vertices(texture(report, bsdf, "Emission Color"), uv)
    assert np.sqrt(np.mean((found - 3.0 * (0.5 * positions + 0.5)) ** 2)) < 0.03
    assert report.request["materials"][bsdf]["sockets"]["Emission Strength"]["value"] == 1.0


def test_glow_below_zero_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "glow.npy", np.full((4, 4, 3), -0.4, np.float32))
    nothing = dict.fromkeys(("leaves", "view", "around", "sides", "left_out", "paths"), ())
    findings = Findings()
    Baked({**nothing, "emission": "glow.npy"}, tmp_path).materials("baked_0001", "Lamp", findings)
    assert findings.errors == ["Material 'Lamp' takes light away (negative emission): make it positive."]


def test_what_one_output_gives_is_baked_once_and_of_what_shines_the_light_alone(
    stage: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A group that many sockets take, beside a glow: four bakes are the light, the faces, a colour and a number."""
    from blender_addon.bake import surface

    baked, bake = [], surface.bake
    monkeypatch.setattr(surface, "bake", lambda stage, kind: (baked.append(kind), bake(stage, kind)))
    _, ball, nodes = stage
    group = bpy.data.node_groups.new("Picture", "ShaderNodeTree")
    group.interface.new_socket("Colour", in_out="OUTPUT", socket_type="NodeSocketColor")
    noise = group.nodes.new("ShaderNodeTexNoise").outputs["Color"]
    group.links.new(noise, group.nodes.new("NodeGroupOutput").inputs[0])
    picture, glow, added = nodes.new("Group"), nodes.new("Emission"), nodes.new("AddShader")
    picture.node_tree = group
    for socket in ("Base Color", "Specular Tint", "Sheen Tint", "Roughness", "Metallic"):
        nodes.tree.links.new(picture.outputs[0], nodes.principled.inputs[socket])
    nodes.tree.links.new(picture.outputs[0], glow.inputs["Color"])
    nodes.tree.links.new(nodes.principled.outputs[0], added.inputs[0])
    nodes.tree.links.new(glow.outputs[0], added.inputs[1])
    nodes.tree.links.new(added.outputs[0], nodes.surface)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shown = {"object": ball.evaluated_get(depsgraph), "matrix_world": ball.matrix_world}
    instance = SimpleNamespace(**shown, is_instance=False, particle_system=None)
    (leaf,) = surface.baked_surface(bpy.context.scene, instance, depsgraph, 0, tmp_path, 64, "scattered")["leaves"]
    assert len(baked) == 4
    sockets = leaf["sockets"]
    assert sockets["Base Color"] == sockets["Specular Tint"] == sockets["Sheen Tint"] != sockets["Roughness"]
    assert sockets["Roughness"] == sockets["Metallic"]
    assert np.load(tmp_path / sockets["Roughness"]).std() > 0.01


@pytest.mark.parametrize("is_mixed", [False, True])
def test_a_colour_in_the_place_of_a_shader_shines(is_mixed: bool, stage: Any, export: Any) -> None:
    """As pictures and flat looks have them; Cycles makes an Emission of it."""
    target, _, nodes = stage
    added = nodes.new("AddShader")
    nodes.tree.links.new(nodes.principled.outputs[0], added.inputs[0])
    nodes.tree.links.new(nodes.place(), added.inputs[1])
    nodes.tree.links.new(added.outputs[0] if is_mixed else nodes.place(), nodes.surface)
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    radiance = attribute(scene, "shape/emitter/texture[@name='radiance']/string", "value")
    found = at_vertices(np.asarray(read_image(report.folder / radiance).pixels), uv)
    assert np.sqrt(np.mean((found - (0.5 * positions + 0.5)) ** 2)) < 0.01
    assert not [note for note in report.notes if "black" in note]
    assert (bsdf in report.request["materials"]) == is_mixed  # alone it reflects nothing


@pytest.mark.parametrize("owner", ["world", "scene", "layer"])
def test_attributes_of_the_view_layer_are_those_of_the_users_scene(owner: str, stage: Any, export: Any) -> None:
    """Cycles looks for them at the view layer, then at the scene, then at the world."""
    target, _, nodes = stage
    owners = {"world": bpy.context.scene.world, "scene": bpy.context.scene, "layer": bpy.context.view_layer}
    for number, name in enumerate(owners):
        owners[name]["wear"] = 0.1 * number
        if name == owner:
            break
    owners[owner]["wear"] = 0.7
    attribute = nodes.new("Attribute")
    attribute.attribute_type, attribute.attribute_name = "VIEW_LAYER", "wear"
    nodes.tree.links.new(attribute.outputs["Fac"], nodes.principled.inputs["Roughness"])
    report = export(target)
    bsdf, _, _ = shape_of(report)
    assert report.request["materials"][bsdf]["sockets"]["Roughness"]["value"] == pytest.approx(0.7, abs=1e-5)


@pytest.mark.parametrize("other", [0.5, 1.5])
def test_a_transparent_bsdf_that_is_not_white_is_named(other: float, stage: Any, export: Any) -> None:
    """Darker or brighter than white, alone or in a mix: light behind was 4 % and more beside Cycles."""
    target, _, nodes = stage
    clear, color = nodes.new("BsdfTransparent"), nodes.new("RGB")
    color.outputs[0].default_value = (other, 1.0, 1.0, 1.0)
    nodes.tree.links.new(color.outputs[0], clear.inputs["Color"])
    nodes.tree.links.new(clear.outputs[0], nodes.surface)
    named = "Material 'Ball': Transparent BSDF is taken for white."
    assert named in export(target).notes
    mix = nodes.new("MixShader")
    nodes.tree.links.new(nodes.principled.outputs[0], mix.inputs[1])
    nodes.tree.links.new(clear.outputs[0], mix.inputs[2])
    nodes.tree.links.new(mix.outputs[0], nodes.surface)
    assert named in export(target).notes
