# SPDX-License-Identifier: Apache-2.0
"""The scene of these studies: a head under a lamp or under an environment."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

LIGHTS = ("lamp", "probe")


def head_scene(light: str, size: int) -> Any:
    """A smooth head with a material of one Principled node, under a lamp or a probe; returns object and node."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.cycles.device = "CPU"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -4.2, 0.9), (math.radians(78.0), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    if light == "lamp":
        lamp = bpy.data.lights.new("Lamp", "POINT")
        lamp.energy, lamp.shadow_soft_size = 700.0, 0.0
        item = bpy.data.objects.new("Lamp", lamp)
        item.location = (2.0, -3.0, 3.0)
        scene.collection.objects.link(item)
    else:
        scene.world = bpy.data.worlds.new("World")
        if scene.world.node_tree is None:
            scene.world.use_nodes = True
        tree: Any = scene.world.node_tree
        picture = tree.nodes.new("ShaderNodeTexEnvironment")
        folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
        picture.image = bpy.data.images.load(str(folder / "courtyard.exr"))
        background = next(node for node in tree.nodes if node.type == "BACKGROUND")
        tree.links.new(picture.outputs[0], background.inputs["Color"])
    bpy.ops.mesh.primitive_monkey_add()
    target = bpy.context.object
    modifier = target.modifiers.new("Smooth", "SUBSURF")
    modifier.levels = modifier.render_levels = 2
    bpy.ops.object.shade_smooth()
    material: Any = bpy.data.materials.new("Head")
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True
    target.data.materials.append(material)
    nodes: Any = material.node_tree.nodes  # pyright: ignore[reportOptionalMemberAccess]
    return target, next(node for node in nodes if node.type == "BSDF_PRINCIPLED")


def side_camera() -> Any:
    """A second camera, 70 degrees around the head and above it."""
    import bpy
    import mathutils

    camera = bpy.data.objects.new("Side", bpy.data.objects["Camera"].data)
    camera.location = (3.8, -1.4, 1.6)
    camera.rotation_euler = (-mathutils.Vector(camera.location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    return camera
