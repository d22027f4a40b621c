# SPDX-License-Identifier: Apache-2.0
"""Building blocks of test scenes in bpy."""

from __future__ import annotations

from typing import Any

import bpy


def new_material(name: str, **sockets: Any) -> Any:
    """A Principled material with the given sockets (spaces as underscores)."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    node = material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    for socket, value in sockets.items():
        target = node.inputs[socket.replace("_", " ")]
        target.default_value = (*value, 1.0) if target.type == "RGBA" else value
    return material


def diffuse_material(name: str, color: tuple[float, float, float]) -> Any:
    """A Lambertian material: the same in both renderers."""
    return _material_of(name, "ShaderNodeBsdfDiffuse", color)


def emission_material(name: str, color: tuple[float, float, float]) -> Any:
    """A material that glows and reflects nothing."""
    return _material_of(name, "ShaderNodeEmission", color)


def _material_of(name: str, node_type: str, color: tuple[float, float, float]) -> Any:
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new(node_type)
    node.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return material


def add_mesh(name: str, vertices: Any, faces: Any, material: Any) -> Any:
    """Link a new mesh object."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(item)
    return item


def add_quad(name: str, size: float, height: float, material: Any) -> Any:
    """A horizontal square around the origin."""
    h = size / 2
    return add_mesh(
        name, [(-h, -h, height), (h, -h, height), (h, h, height), (-h, h, height)], [(0, 1, 2, 3)], material
    )


def add_camera(kind: str = "ORTHO", location: Any = (0, 0, 5), rotation: Any = (0, 0, 0), **settings: Any) -> Any:
    """Add and activate a camera; without rotation it looks down."""
    data = bpy.data.cameras.new("Camera")
    data.type = kind
    for name, value in settings.items():
        setattr(data, name, value)
    item = bpy.data.objects.new("Camera", data)
    item.location, item.rotation_euler = location, rotation
    bpy.context.collection.objects.link(item)
    bpy.context.scene.camera = item
    return item


def add_light(
    kind: str, location: Any = (0, 0, 3), rotation: Any = (0, 0, 0), scale: Any = (1, 1, 1), **settings: Any
) -> Any:
    """Add a light; without rotation it shines down."""
    data = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(data, name, value)
    item = bpy.data.objects.new("Light", data)
    item.location, item.rotation_euler, item.scale = location, rotation, scale
    bpy.context.collection.objects.link(item)
    return item


def world_color(scene: Any, strength: float) -> Any:
    """Give the scene a white world and return its Background node."""
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    node = world.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    node.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    node.inputs["Strength"].default_value = strength
    return node
