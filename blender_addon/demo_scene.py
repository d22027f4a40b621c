# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene of `mfo demo`: a monkey head on a table under one of the environment maps that come with Blender."""

from __future__ import annotations

import colorsys
import math
import random
from pathlib import Path

import bpy

from .versions import nodes_enabled

OBJECT = "Suzanne"
WORLDS = ("city", "courtyard", "forest", "interior", "studio", "sunrise", "sunset")  # night is nearly black


def build_demo_scene(folder: Path, seed: int, size: int = 256) -> dict[str, dict[str, object]]:
    """Write `truth.blend` and `start.blend`: one scene, two materials.

    The materials and the light depend on `seed` alone. Returns the socket values by file: `truth` and `start`.
    """
    draw = random.Random(seed)
    folder.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _set_up_render(size)
    _add_world(draw.choice(WORLDS), rotation=draw.uniform(0, 2 * math.pi))
    _add_camera()
    _add_table()
    sockets = _add_head().inputs
    materials = {name: _random_material(draw) for name in ("truth", "start")}
    for file, values in materials.items():
        for name, value in values.items():
            sockets[name].default_value = value
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{file}.blend"), compress=True, copy=True)
    return materials


def _random_material(draw: random.Random) -> dict[str, object]:
    """Socket values of a plausible opaque material: plastic, metal or something between, often under a coat."""
    hue, saturation, value = draw.random(), draw.uniform(0.2, 0.9), draw.uniform(0.15, 0.85)
    return {
        "Base Color": (*colorsys.hsv_to_rgb(hue, saturation, value), 1.0),
        "Metallic": draw.choice([0.0, 0.0, 0.9, draw.random()]),
        "Roughness": draw.uniform(0.15, 0.7),
        "Specular IOR Level": draw.uniform(0.2, 0.8),
        "Coat Weight": draw.choice([0.0, 0.0, draw.random()]),
        "Coat Roughness": draw.uniform(0.05, 0.3),
    }


def _set_up_render(size: int) -> None:
    """Cycles on the processor, linear and display pictures both meaningful."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"


def _add_world(name: str, rotation: float) -> None:
    """An environment texture turned about the vertical, packed so that the file opens anywhere."""
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = nodes_enabled(world)
    nodes, links = tree.nodes, tree.links
    nodes.clear()
    image = bpy.data.images.load(
        str(Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world" / f"{name}.exr")
    )
    image.pack()
    coordinates = nodes.new("ShaderNodeTexCoord")
    mapping = nodes.new("ShaderNodeMapping")
    environment = nodes.new("ShaderNodeTexEnvironment")
    background = nodes.new("ShaderNodeBackground")
    output = nodes.new("ShaderNodeOutputWorld")
    environment.image = image
    mapping.inputs["Rotation"].default_value[2] = rotation
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    links.new(environment.outputs["Color"], background.inputs["Color"])
    links.new(background.outputs["Background"], output.inputs["Surface"])


def _add_camera() -> None:
    """A camera at portrait distance, slightly above."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (1.4, -4.6, 1.3)
    camera.rotation_euler = (math.radians(77), 0, math.radians(17))
    camera.data.lens = 55
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def _add_table() -> None:
    """A matt table top, so that shadow and reflected light are part of the picture."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=1.9, depth=0.1, location=(0, 0, -1.05))
    table = bpy.context.object
    table.name = "Table"
    _new_material(table, "Table").inputs["Base Color"].default_value = (0.35, 0.33, 0.3, 1)


def _add_head() -> bpy.types.Node:
    """The object to be fitted; returns its Principled node."""
    bpy.ops.mesh.primitive_monkey_add(
        size=2.2, location=(0, 0, 0.05), rotation=(math.radians(-12), 0, math.radians(12))
    )
    head = bpy.context.object
    head.name = OBJECT
    subdivision = head.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 2
    for polygon in head.data.polygons:
        polygon.use_smooth = True
    return _new_material(head, "Head")


def _new_material(target: bpy.types.Object, name: str) -> bpy.types.Node:
    """Give `target` a new Principled material; returns the node."""
    material = bpy.data.materials.new(name)
    target.data.materials.append(material)
    return next(node for node in nodes_enabled(material).nodes if node.type == "BSDF_PRINCIPLED")
