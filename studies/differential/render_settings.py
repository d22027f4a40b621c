# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene that belong to the timeline, to Cycles' own switches, and to pictures on other objects."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import bpy
import numpy as np

from .rig import Draw, Rig, Setting, principled, put_socket


def _bound_camera(rig: Rig, draw: Draw) -> None:
    """A marker of the timeline that binds another camera than the scene's."""
    other = rig.camera.copy()
    other.data = rig.camera.data.copy()
    other.location.x, other.data.lens = float(draw.uniform(-0.6, 0.6)), 60.0
    rig.scene.collection.objects.link(other)
    rig.scene.timeline_markers.new("Cut", frame=1).camera = other
    rig.scene.frame_set(3)
    rig.scene.camera = rig.camera


def _lamp_factors(rig: Rig, _: Draw) -> None:
    """Eevee's factors, which are shown for Cycles in no panel."""
    data: Any = rig.light.data
    data.diffuse_factor, data.specular_factor, data.use_custom_distance = 0.3, 0.2, True
    data.cutoff_distance = 1.0


def _sampling_of_light(kind: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        rig.scene.cycles.direct_light_sampling_type = kind
        if hasattr(rig.light.data, "shadow_soft_size"):
            rig.light.data.shadow_soft_size = float(draw.choice([0.0, 0.5]))

    return put


def _shading_language(rig: Rig, draw: Draw) -> None:
    """Open Shading Language, with a texture that is evaluated by it."""
    rig.scene.cycles.shading_system = True
    tree = rig.box.data.materials[0].node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = float(draw.uniform(1.0, 4.0))
    tree.links.new(noise.outputs["Color"], principled(rig.box).inputs["Base Color"])


def _ambient_bounces(rig: Rig, _: Draw) -> None:
    """Bounces of Fast GI, which is off."""
    rig.scene.render.use_simplify = True
    rig.scene.cycles.ao_bounces_render = rig.scene.cycles.ao_bounces = 1


def _pencil(rig: Rig, _: Draw) -> None:
    """A stroke of Grease Pencil over the picture."""
    bpy.ops.object.grease_pencil_add(type="MONKEY", location=(0.4, -1.4, 0.8), rotation=(0.0, 0.0, 0.0))
    bpy.context.view_layer.objects.active = rig.target


def _attribute_of_data(rig: Rig, draw: Draw) -> None:
    """A custom property of a mesh, which Attribute finds after those of the object."""
    rig.box.data["tint"] = tuple(draw.uniform(0.1, 0.9, 3))
    _attribute(rig, "OBJECT", "tint")


def _attribute_of_place(rig: Rig, _: Draw) -> None:
    """A property of the object itself by its path."""
    rig.box.rotation_euler = (0.4, 0.3, 0.8)
    _attribute(rig, "OBJECT", "rotation_euler")


def _attribute(rig: Rig, kind: str, name: str) -> None:
    tree = rig.box.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = kind, name
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])


def _indices(rig: Rig, _: Draw) -> None:
    """Pass indices of object and material, which Object Info gives."""
    rig.box.pass_index, rig.box.data.materials[0].pass_index = 3, 5
    tree = rig.box.data.materials[0].node_tree
    info, join = tree.nodes.new("ShaderNodeObjectInfo"), tree.nodes.new("ShaderNodeCombineColor")
    for number, output in enumerate(("Object Index", "Material Index")):
        part = tree.nodes.new("ShaderNodeMath")
        part.operation, part.inputs[1].default_value = "MULTIPLY", 0.15
        tree.links.new(info.outputs[output], part.inputs[0])
        tree.links.new(part.outputs[0], join.inputs[number])
    tree.links.new(join.outputs[0], principled(rig.box).inputs["Base Color"])


def _shown_again(rig: Rig, _: Draw) -> None:
    """An instancer of an instancer, the inner one hidden from the camera."""
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    other = rig.box.copy()
    other.location = (0.0, 0.0, 0.0)
    inner.objects.link(other)
    carriers = []
    for name, shows in (("Carrier", inner), ("Whole", outer)):
        empty = bpy.data.objects.new(name, None)
        empty.instance_type, empty.instance_collection = "COLLECTION", shows
        carriers.append(empty)
    carriers[0].visible_camera = carriers[0].visible_shadow = False
    outer.objects.link(carriers[0])
    carriers[1].location, carriers[1].scale = (1.3, -1.7, 0.37), (0.6, 0.7, 0.7)
    rig.scene.collection.objects.link(carriers[1])


def _shown_words(rig: Rig, _: Draw) -> None:
    """A text and a metaball in a collection that an empty shows."""
    made = bpy.data.collections.new("Words")
    text: Any = bpy.data.curves.new("Word", "FONT")
    text.body, text.extrude, text.size = "W", 0.1, 1.0
    ball = bpy.data.metaballs.new("Ball")
    ball.render_resolution = 0.15
    ball.elements.new().radius = 0.6
    for data, place in ((text, (0.0, 0.0, 0.0)), (ball, (0.5, 0.0, 1.2))):
        data.materials.append(rig.box.data.materials[0])
        item = bpy.data.objects.new(data.name, data)
        item.location, item.rotation_euler = place, (math.pi / 2, 0.0, 0.0)
        made.objects.link(item)
    empty = bpy.data.objects.new("Words", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", made, (0.9, -1.33, 0.1)
    rig.scene.collection.objects.link(empty)


def _particles_of_a_collection(rig: Rig, draw: Draw) -> None:
    made = bpy.data.collections.new("Sprinkles")
    for number in range(2):
        other = rig.box.copy()
        other.data = rig.box.data.copy()
        other.scale, other.rotation_euler = (1.0, 1.0, 0.5 + number), (0.3, 0.0, 0.5)
        made.objects.link(other)
    system = rig.floor.modifiers.new("Sprinkled", "PARTICLE_SYSTEM").particle_system
    system.seed = int(draw.integers(100))
    of = system.settings
    of.type, of.count, of.particle_size, of.use_advanced_hair = "HAIR", 10, 0.1, True
    of.render_type, of.instance_collection = "COLLECTION", made
    of.use_whole_collection, of.use_rotation_instance = bool(draw.random() < 0.3), bool(draw.random() < 0.5)
    of.use_scale_instance, of.use_rotations, of.rotation_factor_random = True, True, 0.5
    of.size_random = 0.5


def _strands_of_nodes(rig: Rig, _: Draw) -> None:
    """Geometry nodes that add bare curves."""
    group = bpy.data.node_groups.new("Wires", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    new = group.nodes.new
    given, circle, join, output = (
        new("NodeGroupInput"), new("GeometryNodeCurvePrimitiveCircle"), new("GeometryNodeJoinGeometry"),
        new("NodeGroupOutput"),
    )  # fmt: skip
    radius, group_links = new("GeometryNodeSetCurveRadius"), group.links
    radius.inputs["Radius"].default_value = 0.1
    circle.inputs["Radius"].default_value = 1.0
    group_links.new(circle.outputs[0], radius.inputs[0])
    group_links.new(radius.outputs[0], join.inputs[0])
    group_links.new(given.outputs[0], join.inputs[0])
    group_links.new(join.outputs[0], output.inputs[0])
    rig.box.modifiers.new("Wires", "NODES").node_group = group


def _checks(rig: Rig, draw: Draw) -> Any:
    """A picture with colours and holes on the box's map."""
    values = np.ones((8, 8, 4), np.float32)
    values[..., :3] = draw.uniform(0.05, 0.95, (8, 8, 3))
    values[..., 3] = draw.random((8, 8)) < 0.6
    image = bpy.data.images.new("Leaves", 8, 8, alpha=True)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(rig.folder / "leaves.png"), "PNG"
    image.save()
    node = rig.box.data.materials[0].node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(image.filepath_raw)
    node.interpolation = str(draw.choice(["Linear", "Closest"]))
    return node


def _leaves(rig: Rig, draw: Draw) -> None:
    """A cut-out by the picture's own alpha."""
    node, tree = _checks(rig, draw), rig.box.data.materials[0].node_tree
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])
    tree.links.new(node.outputs["Alpha"], principled(rig.box).inputs["Alpha"])


def _screen(rig: Rig, draw: Draw) -> None:
    node, tree = _checks(rig, draw), rig.box.data.materials[0].node_tree
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Emission Color"])
    put_socket(rig.box, "Emission Strength", float(draw.uniform(1.0, 4.0)))


def _dark_emission(owner: str) -> Callable[[Rig, Draw], None]:
    """An Emission that takes light away, added to an object's shader."""

    def put(rig: Rig, _: Draw) -> None:
        item = getattr(rig, owner)
        tree = item.data.materials[0].node_tree
        glow, added = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeAddShader")
        glow.inputs["Strength"].default_value = -0.4
        tree.links.new(principled(item).outputs[0], added.inputs[0])
        tree.links.new(glow.outputs[0], added.inputs[1])
        tree.links.new(added.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])

    return put


def _below_zero(rig: Rig, _: Draw) -> None:
    """A world that takes light away, over lamps that give it."""
    node = next(node for node in rig.scene.world.node_tree.nodes if node.type == "BACKGROUND")
    node.inputs["Strength"].default_value = -0.1


def _sculpted(rig: Rig, _: Draw) -> None:
    """A box in sculpt mode, with one level of Multires of two."""
    bpy.context.view_layer.objects.active = rig.box
    made: Any = rig.box.modifiers.new("Multires", "MULTIRES")
    for _again in range(2):
        bpy.ops.object.multires_subdivide(modifier="Multires", mode="CATMULL_CLARK")
    made.sculpt_levels, made.levels, made.render_levels = 0, 0, 2
    bpy.ops.object.mode_set(mode="SCULPT")


def _all() -> Iterator[Setting]:
    exported = {
        "bound camera": _bound_camera, "lamp factors": _lamp_factors, "ambient bounces": _ambient_bounces,
        "shading language": _shading_language, "attribute of data": _attribute_of_data,
        "attribute of place": _attribute_of_place, "indices": _indices, "shown again": _shown_again,
        "shown words": _shown_words, "particles of a collection": _particles_of_a_collection, "leaves": _leaves,
        "screen": _screen,     }  # fmt: skip
    yield from (Setting(name, put) for name, put in exported.items())
    for owner in ("box", "target"):
        yield Setting(f"dark emission of the {owner}", _dark_emission(owner), ("takes light away",))
    yield Setting("below zero", _below_zero, ("takes light away",))
    yield Setting("sculpted", _sculpted, ("Sculpt Mode",))
    yield Setting("grease pencil", _pencil, ("ease",))
    yield Setting("strands of nodes", _strands_of_nodes, ("Curves",))
    for kind in ("FORWARD_PATH_TRACING", "NEXT_EVENT_ESTIMATION"):
        words = f"light by {kind.split('_')[0].lower()}"
        yield Setting(words, _sampling_of_light(kind), ("Direct Light Sampling",))


RENDER_SETTINGS = tuple(_all())
