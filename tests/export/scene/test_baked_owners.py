# SPDX-License-Identifier: Apache-2.0
"""What nodes are told of the object and the mesh that they are on, against Cycles."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.bake.stage import copy_properties

from ..baked_shapes import at_vertices, shape_of, texture
from ..scenes import add_camera, add_quad, new_material, world_color
from .test_baked_surfaces import Nodes

CENTRE = np.s_[16, 16]  # of a picture of 32 x 32 pixels


@pytest.fixture
def stage(scene: Any) -> tuple[Any, Any]:
    """A target at a side, and a box in the middle of the picture."""
    world_color(scene, 1.0)
    scene.render.resolution_x = scene.render.resolution_y = 32
    add_camera("ORTHO", ortho_scale=4.0)
    target = add_quad("Target", 0.5, 1.5, new_material("Target"))
    target.location.x = 1.2
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.name = "Box"
    box.data.materials.append(new_material("Box"))
    return target, box


def shown_and_baked(told: Any, target: Any, export: Any, render_cycles: Any) -> tuple[np.ndarray, list[np.ndarray]]:
    """Cycles' picture of what a node's Color is told, shining, and what it is as Base Color in each baked material."""
    tree = told.id_data
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    surface, glow = tree.get_output_node("CYCLES").inputs["Surface"], tree.nodes.new("ShaderNodeEmission")
    tree.links.new(told.outputs["Color"], glow.inputs["Color"])
    tree.links.new(glow.outputs[0], surface)
    picture = render_cycles()
    tree.links.new(principled.outputs[0], surface)
    tree.nodes.remove(glow)
    tree.links.new(told.outputs["Color"], principled.inputs["Base Color"])
    materials = export(target).request["materials"]
    baked = {name: found["sockets"]["Base Color"]["value"] for name, found in materials.items() if "baked" in name}
    return picture, [np.array(baked[name]) for name in sorted(baked)]


LAST_SUBDIVISION = pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="Blender 4 loses them there, too")


@pytest.mark.parametrize(
    ("modifiers", "is_lost"),
    [
        ((), False),
        (("SMOOTH",), False),
        (("TRIANGULATE",), True),
        (("SUBSURF", "SMOOTH"), True),
        (("TRIANGULATE", "SUBSURF"), True),
        pytest.param(("SUBSURF",), False, marks=LAST_SUBDIVISION),
        pytest.param(("SMOOTH", "SUBSURF"), False, marks=LAST_SUBDIVISION),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else None,
)
def test_a_property_of_the_mesh_is_gone_where_a_modifier_makes_a_new_one(
    modifiers: tuple[str, ...], is_lost: bool, stage: Any, export: Any, render_cycles: Any
) -> None:
    """A Subdivision makes none where it is the last."""
    target, box = stage
    box.data["tint"] = (0.2, 0.5, 0.8)
    box.data.update_tag()
    for modifier in modifiers:
        box.modifiers.new("Modifier", modifier)
    told = box.data.materials[0].node_tree.nodes.new("ShaderNodeAttribute")
    told.attribute_type, told.attribute_name = "OBJECT", "tint"
    picture, (baked,) = shown_and_baked(told, target, export, render_cycles)
    np.testing.assert_allclose(baked, picture[CENTRE][:3], atol=1e-4)
    assert (baked.max() < 1e-4) == is_lost


@pytest.mark.parametrize("by_other", [False, True])
@pytest.mark.parametrize("modifiers", [(), ("SUBSURF",)], ids=["plain", "subdivided"])
def test_a_mesh_that_is_edited_has_no_properties(
    modifiers: tuple[str, ...], by_other: bool, stage: Any, export: Any, render_cycles: Any
) -> None:
    target, box = stage
    box.data["tint"] = (0.2, 0.5, 0.8)
    for modifier in modifiers:
        box.modifiers.new("Modifier", modifier)
    edited = box
    if by_other:
        edited = bpy.data.objects.new("Edited", box.data)
        edited.location.x = -9.0
        bpy.context.scene.collection.objects.link(edited)
    told = box.data.materials[0].node_tree.nodes.new("ShaderNodeAttribute")
    told.attribute_type, told.attribute_name = "OBJECT", "tint"
    bpy.context.view_layer.objects.active = edited
    edited.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    picture, baked = shown_and_baked(told, target, export, render_cycles)
    assert len(baked) == 1 + by_other
    np.testing.assert_allclose(baked, [picture[CENTRE][:3]] * len(baked), atol=1e-4)
    assert np.max(baked) < 1e-4


@pytest.mark.parametrize("is_shown", [False, True])
def test_an_instance_has_the_colour_of_its_instancer(
    is_shown: bool, stage: Any, export: Any, render_cycles: Any
) -> None:
    """Four instances of a box, two of them of one colour, which share a bake; the box may be there itself, too.

    Where Python has seen the box itself, it finds that in all of its instances.
    """
    target, box = stage
    box.color = (0.9, 0.9, 0.1, 1.0)
    prefab = bpy.data.collections.new("Prefab")
    prefab.objects.link(box)
    if not is_shown:
        bpy.context.scene.collection.objects.unlink(box)
    colors = ((0.8, 0.2, 0.1, 1.0), (0.1, 0.3, 0.9, 1.0), (0.1, 0.9, 0.3, 1.0), (0.1, 0.3, 0.9, 1.0))
    for place, color in zip(((-1.2, -1.2), (0.0, -1.2), (-1.2, 1.2), (0.0, 1.2)), colors, strict=True):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection, empty.color = "COLLECTION", prefab, color
        empty.location = (*place, 0.0)
        bpy.context.scene.collection.objects.link(empty)
    told = box.data.materials[0].node_tree.nodes.new("ShaderNodeObjectInfo")
    picture, baked = shown_and_baked(told, target, export, render_cycles)
    assert len(baked) == 3 + is_shown
    seen = picture.reshape(-1, picture.shape[-1])[:, :3]
    for color in baked:
        assert np.abs(seen - color).max(axis=1).min() < 1e-3


@pytest.mark.parametrize("shown_by", ["VERTS", "FACES", "particles"])
def test_an_instance_has_that_colour_where_its_object_is_in_the_scene_itself(
    shown_by: str, stage: Any, export: Any, render_cycles: Any
) -> None:
    """Python that has met the object has its colour from then on, whatever instance of it it is asked about."""
    target, box = stage
    box.color, box.location.x = (0.9, 0.9, 0.1, 1.0), -0.8
    carrier = add_quad("Carrier", 0.6, 1.0, new_material("Carrier"))
    carrier.color = (0.1, 0.3, 0.9, 1.0)
    if shown_by == "particles":
        made = carrier.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
        made.type, made.count, made.particle_size, made.use_advanced_hair = "HAIR", 3, 0.5, True
        made.render_type, made.instance_object = "OBJECT", box
    else:
        carrier.instance_type, box.parent = shown_by, carrier
    told = box.data.materials[0].node_tree.nodes.new("ShaderNodeObjectInfo")
    picture, baked = shown_and_baked(told, target, export, render_cycles)
    seen = picture.reshape(-1, picture.shape[-1])[:, :3]
    assert np.abs(seen - carrier.color[:3]).max(axis=1).min() < 1e-3
    assert np.abs(np.array(baked) - carrier.color[:3]).max(axis=1).min() < 1e-3


@pytest.mark.parametrize("is_displaced", [False, True])
def test_particles_of_what_is_not_rendered_are_baked_without_its_modifiers(
    is_displaced: bool, scene: Any, stage: Any, in_both: Any
) -> None:
    """Cycles takes none of them; baked with them the object had other faces, and was grey and not displaced."""
    target, box = stage
    scene.cycles.samples = 256
    box.hide_render = True
    box.modifiers.new("Round", "SUBSURF").render_levels = 2
    nodes = Nodes(box.data.materials[0])
    colors = nodes.new("TexCoord").outputs["Generated"]
    nodes.tree.links.new(colors, nodes.principled.inputs["Base Color"])
    if is_displaced:
        moved = nodes.new("VectorDisplacement")
        nodes.tree.links.new(colors, moved.inputs["Vector"])
        nodes.tree.links.new(moved.outputs[0], nodes.tree.get_output_node("CYCLES").inputs["Displacement"])
        box.data.materials[0].displacement_method = "DISPLACEMENT"
    carrier = add_quad("Carrier", 2.0, -1.0, new_material("Carrier"))
    made = carrier.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    made.type, made.count, made.particle_size, made.use_advanced_hair = "HAIR", 1, 0.5, True
    made.render_type, made.instance_object = "OBJECT", box
    report, ours, theirs = in_both(target)
    assert [note for note in report.notes if "could not be baked" in note or "left out" in note] == []
    off = (ours - theirs).mean(axis=2).reshape(4, 8, 4, 8).mean(axis=(1, 3)) / theirs.mean()
    assert abs(off).max() < 0.02


@pytest.mark.parametrize("shown_by", ["parent", "instancer"])
def test_an_object_is_told_its_own_place(shown_by: str, stage: Any, export: Any, render_cycles: Any) -> None:
    """By its path, whatever its parent or its instancer does to it; a bake had what both make together."""
    target, box = stage
    box.rotation_euler, box.location = (0.4, 0.3, 0.8), (0.1, 0.2, 0.0)
    if shown_by == "parent":
        box.parent = bpy.data.objects.new("Carrier", None)
        carrier = box.parent
    else:
        carrier = bpy.data.objects.new("Instance", None)
        prefab = bpy.data.collections.new("Prefab")
        prefab.objects.link(box)
        bpy.context.scene.collection.objects.unlink(box)
        carrier.instance_type, carrier.instance_collection = "COLLECTION", prefab
    carrier.rotation_euler, carrier.scale = (0.2, 0.1, 0.5), (0.9, 0.6, 0.8)
    bpy.context.scene.collection.objects.link(carrier)
    told = box.data.materials[0].node_tree.nodes.new("ShaderNodeAttribute")
    told.attribute_type, told.attribute_name = "OBJECT", "rotation_euler"
    picture, (baked,) = shown_and_baked(told, target, export, render_cycles)
    np.testing.assert_allclose(picture[CENTRE][:3], (0.4, 0.3, 0.8), atol=1e-4)
    np.testing.assert_allclose(baked, picture[CENTRE][:3], atol=1e-4)


def test_settings_that_an_older_blender_left_are_no_properties_of_the_user(scene: Any) -> None:
    """Files saved before Blender 5 have Cycles' own among them, which no other may be given."""
    owner, item = (bpy.data.objects.new(name, None) for name in ("Owner", "Item"))
    owner["cycles"], owner["tint"] = {"use_deform_motion": 0}, 0.5
    copy_properties((owner,), item)
    assert dict(item.items()) == {"tint": 0.5}


@pytest.mark.parametrize("joined", [False, True])
def test_a_mesh_that_geometry_nodes_make_has_its_own_bake(
    joined: bool, stage: Any, export: Any, render_cycles: Any
) -> None:
    """A cube of the nodes knows a tone that the box before them, of as many faces, does not."""
    target, box = stage
    material, plain = box.data.materials[0], new_material("Plain")
    box.data.materials[0] = plain
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    kinds = ("MeshCube", "StoreNamedAttribute", "SetMaterial", "InstanceOnPoints", "JoinGeometry", "MeshLine")
    cube, tone, painted, instances, join, line = (group.nodes.new(f"GeometryNode{kind}") for kind in kinds)
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    line.inputs["Count"].default_value, cube.inputs["Size"].default_value = 1, (1.2, 1.2, 1.2)
    tone.data_type, tone.domain, tone.inputs["Name"].default_value = "FLOAT_COLOR", "POINT", "tone"
    next(s for s in tone.inputs if s.name == "Value" and s.enabled).default_value = (0.2, 0.5, 0.8, 1.0)
    painted.inputs["Material"].default_value = material
    chain = [cube.outputs["Mesh"], tone.inputs[0], tone.outputs[0], painted.inputs[0]]
    chain += [painted.outputs[0], instances.inputs["Instance"], line.outputs[0], instances.inputs["Points"]]
    chain += [instances.outputs[0], join.inputs[0], join.outputs[0], end.inputs[0]]
    chain += [start.outputs[0], join.inputs[0]] if joined else []
    for first, second in zip(chain[::2], chain[1::2], strict=True):
        group.links.new(first, second)
    box.modifiers.new("Scatter", "NODES").node_group = group
    told = material.node_tree.nodes.new("ShaderNodeAttribute")
    told.attribute_name = "tone"
    picture, (baked,) = shown_and_baked(told, target, export, render_cycles)
    np.testing.assert_allclose(baked, (0.2, 0.5, 0.8), atol=1e-3)
    np.testing.assert_allclose(baked, picture[CENTRE][:3], atol=1e-3)


def test_what_cycles_has_no_node_for_has_no_link(stage: Any, export: Any, render_cycles: Any) -> None:
    """Shader to RGB is Eevee's: Cycles takes the ramp's own factor, and a bake had white where the link ended."""
    target, box = stage
    tree = box.data.materials[0].node_tree
    kinds = ("ShaderNodeBsdfDiffuse", "ShaderNodeShaderToRGB", "ShaderNodeValToRGB")
    shader, seen, told = (tree.nodes.new(kind) for kind in kinds)
    tree.links.new(shader.outputs[0], seen.inputs[0])
    tree.links.new(seen.outputs[0], told.inputs[0])
    told.inputs[0].default_value = 0.25
    told.color_ramp.elements[0].color = (0.8, 0.1, 0.4, 1.0)
    picture, (baked,) = shown_and_baked(told, target, export, render_cycles)
    np.testing.assert_allclose(baked, picture[CENTRE][:3], atol=1e-3)
    np.testing.assert_allclose(baked, (0.85, 0.325, 0.55), atol=1e-3)
    principled = next(node for node in target.data.materials[0].node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    plain = export(target, "plain").request["materials"]["target_bsdf"]["sockets"]["Base Color"]
    own = target.data.materials[0].node_tree
    own.links.new(own.nodes.new("ShaderNodeShaderToRGB").outputs[0], principled.inputs["Base Color"])
    linked = export(target, "linked").request["materials"]["target_bsdf"]["sockets"]["Base Color"]
    assert linked["value"] == plain["value"]


@pytest.mark.parametrize("kind", ["SIMPLE_DEFORM", "MIRROR"])
def test_a_modifier_that_looks_at_another_object_finds_an_instance_where_its_object_is(
    stage: Any, export: Any, kind: str
) -> None:
    """Faces of an instance had the modifiers as if its object were in the instance's place, and Position was theirs."""
    (target, box), nodes = stage, Nodes(stage[1].data.materials[0])
    other = bpy.data.objects.new("Other", None)
    other.location, other.rotation_euler = (0.3, 0.0, 0.2), (0.3, 0.2, 0.0)
    bpy.context.scene.collection.objects.link(other)
    modifier: Any = box.modifiers.new("Looks", kind)
    if kind == "SIMPLE_DEFORM":
        modifier.deform_method, modifier.factor, modifier.origin = "TAPER", 0.5, other
    else:
        modifier.mirror_object = other
    box.modifiers.new("Divided", "SUBSURF").render_levels = 3
    nodes.tree.links.new(nodes.place(), nodes.principled.inputs["Base Color"])
    prefab, instance = bpy.data.collections.new("Prefab"), bpy.data.objects.new("Instance", None)
    prefab.objects.link(box)
    bpy.context.scene.collection.objects.unlink(box)
    instance.instance_type, instance.instance_collection = "COLLECTION", prefab
    instance.location, instance.scale, instance.rotation_euler = (-0.3, 0.2, 0.1), (0.6, 0.8, 0.7), (0.0, 0.5, 0.0)
    bpy.context.scene.collection.objects.link(instance)
    report = export(target)
    bsdf, positions, uv = shape_of(report)
    found = at_vertices(texture(report, bsdf, "Base Color"), uv)
    assert np.sqrt(np.mean((found - 0.5 * positions - 0.5) ** 2)) < 0.01
