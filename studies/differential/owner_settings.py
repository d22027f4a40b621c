# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene that belong to what shows an object: instancers, particles, the viewport."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import bpy
from mathutils import Vector

from .artist_settings import bumped_box
from .rig import Draw, Rig, Setting, color_of, put_socket


def _instancer(rig: Rig, *, scale: tuple[float, float, float] = (0.7, 0.7, 0.7)) -> Any:
    """An empty that shows a copy of the box beside the ball."""
    made = bpy.data.collections.new("Shown")
    other = rig.box.copy()
    other.name, other.location = "Copy", (0.0, 0.0, 0.0)
    made.objects.link(other)
    empty = bpy.data.objects.new("Instancer", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", made
    others = sum(item.name.startswith("Instancer") for item in rig.scene.objects)  # not in one place with those
    empty.location, empty.scale = (1.5 - 0.13 * others, -1.0 - 0.41 * others, 0.4 + 0.07 * others), scale
    rig.scene.collection.objects.link(empty)
    return empty


def _of_instancer(**values: Any) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, _: Draw) -> None:
        empty = _instancer(rig)
        for name, value in values.items():
            setattr(empty, name, value)

    return put


def _lamp_of_instancer(**values: Any) -> Callable[[Rig, Draw], None]:
    """A lamp in view, shown by an empty."""

    def put(rig: Rig, draw: Draw) -> None:
        made = bpy.data.collections.new("Lamps")
        lamp = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
        lamp.data.energy, lamp.data.shadow_soft_size = float(draw.uniform(40.0, 120.0)), 0.3
        lamp.visible_camera = True
        made.objects.link(lamp)
        empty = bpy.data.objects.new("Fitting", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", made
        empty.location = (1.4, -1.0, 2.2)
        for name, value in values.items():
            setattr(empty, name, value)
        rig.scene.collection.objects.link(empty)

    return put


def _lamp_of_collection(flag: str, x: float) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, _: Draw) -> None:
        made = bpy.data.collections.new("Bulbs")
        rig.scene.collection.children.link(made)
        lamp = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
        lamp.data.energy, lamp.data.shadow_soft_size, lamp.location = 80.0, 0.3, (x, -1.0, 2.2)
        lamp.visible_camera = True
        made.objects.link(lamp)
        setattr(bpy.context.view_layer.layer_collection.children[made.name], flag, True)

    return put


def _linked_mesh(kind: str) -> Callable[[Rig, Draw], None]:
    """A glowing box that lights, or is shadowed by, the ball alone."""

    def put(rig: Rig, _: Draw) -> None:
        put_socket(rig.box, "Emission Strength", 3.0)
        made = bpy.data.collections.new("Linked")
        made.objects.link(rig.target)
        setattr(rig.box.light_linking, kind, made)

    return put


def _screw(rig: Rig, draw: Draw) -> None:
    """A profile that is turned round: few steps in the viewport, more in the render."""
    mesh = bpy.data.meshes.new("Profile")
    mesh.from_pydata([(0.5, 0.0, 0.0), (0.3, 0.0, 0.5), (0.5, 0.0, 1.0)], [(0, 1), (1, 2)], [])
    item = bpy.data.objects.new("Vase", mesh)
    mesh.materials.append(rig.box.data.materials[0])
    item.location = (1.4, -1.0, 0.02)
    rig.scene.collection.objects.link(item)
    made: Any = item.modifiers.new("Screw", "SCREW")
    made.steps, made.render_steps = 3, int(draw.integers(8, 32))


def _ocean(rig: Rig, _: Draw) -> None:
    made: Any = rig.floor.modifiers.new("Ocean", "OCEAN")
    made.geometry_mode, made.viewport_resolution, made.resolution = "GENERATE", 3, 8
    made.spatial_size, made.wave_scale, made.size = 10, 0.5, 1.0


def _group(name: str) -> Any:
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    return group


def _is_viewport(rig: Rig, _: Draw) -> None:
    """Geometry nodes that leave the box out in the viewport."""
    group = _group("Light in the viewport")
    new = group.nodes.new
    given, switch, asks, output = (
        new("NodeGroupInput"), new("GeometryNodeSwitch"), new("GeometryNodeIsViewport"), new("NodeGroupOutput")
    )  # fmt: skip
    switch.input_type = "GEOMETRY"
    group.links.new(asks.outputs[0], switch.inputs["Switch"])
    group.links.new(given.outputs[0], switch.inputs["False"])
    group.links.new(switch.outputs[0], output.inputs[0])
    rig.box.modifiers.new("Nodes", "NODES").node_group = group


def _few_in_viewport(kind: str) -> Callable[[Rig, Draw], None]:
    """Boxes scattered on the floor, of which the viewport shows some."""

    def put(rig: Rig, draw: Draw) -> None:
        system = rig.floor.modifiers.new("Scattered", "PARTICLE_SYSTEM").particle_system
        made = system.settings
        made.type, made.count, made.particle_size = kind, 12, 0.08
        if kind == "HAIR":
            made.use_advanced_hair = True
        else:
            made.frame_start = made.frame_end = -1.0
            made.physics_type, made.lifetime = "NO", 100.0
        made.render_type, made.instance_object = "OBJECT", rig.box
        if draw.random() < 0.5:
            made.display_percentage = 25
        else:
            made.display_method = "NONE"

    return put


def _children(rig: Rig, _: Draw, seed: int = 0) -> None:
    system = rig.floor.modifiers.new("Clumps", "PARTICLE_SYSTEM").particle_system
    system.seed = seed
    made = system.settings
    made.type, made.count, made.particle_size, made.use_advanced_hair = "HAIR", 4, 0.06, True
    made.render_type, made.instance_object = "OBJECT", rig.box
    made.child_type, made.child_percent, made.rendered_child_count = "SIMPLE", 1, 6
    made.child_radius = 0.6


def _simplified_children(rig: Rig, draw: Draw) -> None:
    _children(rig, draw, seed=1)  # beside those of the other setting
    render = rig.scene.render
    render.use_simplify, render.simplify_child_particles, render.simplify_child_particles_render = True, 1.0, 0.5


def _emitter_hidden(rig: Rig, draw: Draw) -> None:
    """Particles on a tilted copy of the floor, which is not rendered itself."""
    carrier = rig.floor.copy()
    carrier.data = rig.floor.data.copy()
    rig.scene.collection.objects.link(carrier)
    carrier.location, carrier.scale = (0.5, 1.5, 0.2), (0.2, 0.2, 0.2)
    system = carrier.modifiers.new("Scattered", "PARTICLE_SYSTEM").particle_system
    made = system.settings
    made.type, made.count, made.particle_size, made.use_advanced_hair = "HAIR", 8, 0.3, True
    made.render_type, made.instance_object = "OBJECT", rig.box
    made.size_random = 0.5  # no two tops in one plane
    carrier.show_instancer_for_render = False


def _ramp(rig: Rig, output: Any) -> None:
    """A colour that changes with a number."""
    tree = rig.box.data.materials[0].node_tree
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.9, 0.1, 0.1, 1.0), (0.1, 0.2, 0.9, 1.0)
    tree.links.new(output, ramp.inputs[0])
    color_of(rig, ramp.outputs[0])


def _random_of_instances(rig: Rig, _: Draw) -> None:
    tree = rig.box.data.materials[0].node_tree
    _ramp(rig, tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"])
    _instancer(rig)


def _random_of_particles(rig: Rig, draw: Draw) -> None:
    tree = rig.box.data.materials[0].node_tree
    _ramp(rig, tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"])
    _few(rig, 6)


def _few(rig: Rig, count: int) -> None:
    system = rig.floor.modifiers.new("Some", "PARTICLE_SYSTEM").particle_system
    made = system.settings
    made.type, made.count, made.particle_size, made.use_advanced_hair = "HAIR", count, 0.12, True
    made.render_type, made.instance_object = "OBJECT", rig.box


def _particle_info(rig: Rig, _: Draw) -> None:
    tree = rig.box.data.materials[0].node_tree
    _ramp(rig, tree.nodes.new("ShaderNodeParticleInfo").outputs["Random"])
    _few(rig, 6)


def _position_of_instances(rig: Rig, _: Draw) -> None:
    tree = rig.box.data.materials[0].node_tree
    place, apart = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(place.outputs["Position"], apart.inputs[0])
    _ramp(rig, apart.outputs[2])
    _instancer(rig)
    _instancer(rig, scale=(0.5, 0.5, 0.9)).location = (0.3, -1.8, 0.3)


def _seen_from_an_empty(rig: Rig, _: Draw) -> None:
    """Coordinates of another object."""
    empty = bpy.data.objects.new("Center", None)
    empty.location, empty.scale = (1.0, -1.0, 0.5), (0.7, 0.7, 0.7)
    rig.scene.collection.objects.link(empty)
    tree = rig.box.data.materials[0].node_tree
    where, checker = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexChecker")
    where.object, checker.inputs["Scale"].default_value = empty, 3.0
    tree.links.new(where.outputs["Object"], checker.inputs["Vector"])
    color_of(rig, checker.outputs[0])
    _instancer(rig)


def _instancer_attribute(rig: Rig, draw: Draw) -> None:
    empty = _instancer(rig)
    empty["tint"] = tuple(draw.uniform(0.1, 0.9, 3))
    node = rig.box.data.materials[0].node_tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "INSTANCER", "tint"
    color_of(rig, node.outputs["Color"])


def _from_instancer(rig: Rig, _: Draw) -> None:
    """Generated coordinates of the floor, on particles."""
    node = rig.box.data.materials[0].node_tree.nodes.new("ShaderNodeTexCoord")
    node.from_instancer = True
    color_of(rig, node.outputs["Generated"])
    _few(rig, 6)


def _turned_directions(rig: Rig, _: Draw) -> None:
    """Normals in the world, by a Vector Transform of object coordinates."""
    tree = rig.box.data.materials[0].node_tree
    where, turned = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorTransform")
    turned.vector_type, turned.convert_from, turned.convert_to = "NORMAL", "OBJECT", "WORLD"
    tree.links.new(where.outputs["Normal"], turned.inputs[0])
    color_of(rig, turned.outputs[0])
    _instancer(rig).rotation_euler = (0.4, 0.8, 0.3)


def _mirrored_instance(rig: Rig, draw: Draw) -> None:
    bumped_box(rig, draw)
    _instancer(rig, scale=(-0.9, 0.9, 0.7))


def _on_vertices(rig: Rig, draw: Draw) -> None:
    carrier = bpy.data.objects.new("Carrier", rig.floor.data.copy())
    carrier.location, carrier.scale = (0.6, 0.2, 0.3), (0.15, 0.15, 0.15)
    carrier.instance_type, carrier.use_instance_vertices_rotation = "VERTS", bool(draw.random() < 0.5)
    carrier.show_instancer_for_render = False
    rig.scene.collection.objects.link(carrier)
    rig.box.parent = carrier


def _on_a_bone(rig: Rig, draw: Draw) -> None:
    item = bpy.data.objects.new("Arm", bpy.data.armatures.new("Arm"))
    rig.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    bone = item.data.edit_bones.new("Bone")
    bone.head, bone.tail = (0.0, 0.0, 0.0), (0.0, 0.0, 0.6)
    bpy.ops.object.mode_set(mode="OBJECT")
    item.location = (-1.4, -0.6, 0.2)
    item.pose.bones["Bone"].rotation_mode = "XYZ"
    item.pose.bones["Bone"].rotation_euler = tuple(draw.uniform(-0.4, 0.4, 3))
    rig.box.location = (0.0, 0.0, 0.0)
    rig.box.parent, rig.box.parent_type, rig.box.parent_bone = item, "BONE", "Bone"
    bpy.context.view_layer.objects.active = rig.target


def _eye_closed(rig: Rig, draw: Draw) -> None:
    """Out of sight in the viewport by the eye, its collection's eye, or a modifier's screen."""
    how = int(draw.integers(3))
    if how == 0:
        rig.box.hide_set(True)
    elif how == 1:
        made = bpy.data.collections.new("Shut")
        rig.scene.collection.children.link(made)
        for owner in list(rig.box.users_collection):
            owner.objects.unlink(rig.box)
        made.objects.link(rig.box)
        bpy.context.view_layer.layer_collection.children["Shut"].hide_viewport = True
    else:
        made = rig.box.modifiers.new("Array", "ARRAY")
        made.relative_offset_displace, made.show_viewport = (1.2, 0.3, 0.0), False
        other = rig.box.modifiers.new("Bevel", "BEVEL")
        other.width, other.show_render = 0.3, False


def _nested(rig: Rig, _: Draw) -> None:
    """In a collection that is shown, below one that is not rendered."""
    outer, inner = bpy.data.collections.new("Outer"), bpy.data.collections.new("Inner")
    rig.scene.collection.children.link(outer)
    outer.children.link(inner)
    for owner in list(rig.box.users_collection):
        owner.objects.unlink(rig.box)
    inner.objects.link(rig.box)
    outer.hide_render = True


def _cut_by_what_is_hidden(rig: Rig, draw: Draw) -> None:
    """A hole in the box, of a mesh that is rounder in a render and hidden there, as cutters are."""
    cutter = rig.target.copy()
    cutter.data = bpy.data.meshes.new("Cutter")
    rig.scene.collection.objects.link(cutter)
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cutter.data.from_pydata(corners, [], sides)
    cutter.location = rig.box.matrix_world @ Vector((0.4, -0.5, 0.3))
    around = cutter.modifiers.new("Round", "SUBSURF")
    around.levels, around.render_levels = 0, int(draw.integers(1, 4))
    cutter.hide_render = True
    hole = rig.box.modifiers.new("Hole", "BOOLEAN")
    hole.object, hole.solver = cutter, "EXACT"


def _edited(rig: Rig, draw: Draw) -> None:
    """The box in Edit Mode, or another object that has its mesh."""
    rig.box.modifiers.new("Bevel", "BEVEL").width = 0.2
    edited = rig.box
    if draw.random() < 0.5:
        edited = bpy.data.objects.new("Edited", rig.box.data)
        edited.location = (2.2, 1.4, 0.6)
        rig.scene.collection.objects.link(edited)
    edited.hide_set(False)
    bpy.context.view_layer.objects.active = edited
    edited.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")


def _all() -> Iterator[Setting]:
    of_viewport, of_instance = ("viewport",), ("of each instance",)
    yield Setting("instancer", _of_instancer())
    yield Setting("instancer without shadow", _of_instancer(visible_shadow=False), ("how much of its own light",))
    yield Setting("instancer hidden from diffuse", _of_instancer(visible_diffuse=False))
    yield Setting("instancer hidden from glossy", _of_instancer(visible_glossy=False))
    yield Setting("instancer hidden from camera", _of_instancer(visible_camera=False))
    yield Setting("instancer a holdout", _of_instancer(is_holdout=True), ("holdout",))
    yield Setting("instancer a catcher", _of_instancer(is_shadow_catcher=True), ("shadow catcher",))
    yield Setting("lamp of an instancer", _lamp_of_instancer())
    yield Setting("lamp's instancer hidden from camera", _lamp_of_instancer(visible_camera=False))
    yield Setting("lamp's instancer hidden from diffuse", _lamp_of_instancer(visible_diffuse=False), ("hidden from",))
    yield Setting("lamp indirect only", _lamp_of_collection("indirect_only", 0.2))
    yield Setting("lamp in a holdout collection", _lamp_of_collection("holdout", -1.4))
    yield Setting("mesh light linking", _linked_mesh("receiver_collection"), ("Light linking",))
    yield Setting("mesh shadow linking", _linked_mesh("blocker_collection"), ("Light linking",))
    yield Setting("screw", _screw)
    yield Setting("ocean", _ocean)
    yield Setting("is viewport", _is_viewport, of_viewport)
    yield Setting("few hairs in the viewport", _few_in_viewport("HAIR"))
    yield Setting("few particles in the viewport", _few_in_viewport("EMITTER"), of_viewport)
    yield Setting("children", _children)
    yield Setting("simplified children", _simplified_children)
    yield Setting("hidden emitter", _emitter_hidden)
    yield Setting("random of an instance", _random_of_instances)
    yield Setting("random of particles", _random_of_particles)
    yield Setting("particle info", _particle_info, of_instance)
    yield Setting("positions of instances", _position_of_instances)
    yield Setting("coordinates of an empty", _seen_from_an_empty)
    yield Setting("instancer's attribute", _instancer_attribute, of_instance)
    yield Setting("from instancer", _from_instancer, of_instance)
    yield Setting("turned directions", _turned_directions)
    yield Setting("mirrored instance", _mirrored_instance)
    yield Setting("on vertices", _on_vertices)
    yield Setting("on a bone", _on_a_bone)
    yield Setting("eye closed", _eye_closed)
    yield Setting("nested collections", _nested)
    yield Setting("edited mesh", _edited)
    yield Setting("hidden cutter", _cut_by_what_is_hidden)


OWNER_SETTINGS = tuple(_all())
