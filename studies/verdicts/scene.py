# SPDX-License-Identifier: Apache-2.0
"""The scenes of `studies.verdicts`, run by a Python with `bpy`.

    python -m studies.verdicts.scene KIND NUMBER FOLDER

writes FOLDER/truth.blend, start.blend, the reference (reference.exr, and reference.png under AgX) and floor.exr: the
truth once more with other noise.
"""

from __future__ import annotations

import argparse
import json
import math
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from .cases import KINDS, PLANTS, Case, sockets_of, start_of

TARGET = "Target"
SHIFT_PIXELS = 3.0
LEVEL = 1.5
PROBE_TURN, LAMP_TURN = 1.2, 0.9  # radians


def build(case: Case, folder: Path) -> None:
    """Write both files, the reference and the floor."""
    folder.mkdir(parents=True, exist_ok=True)
    _scene(case)
    _set_material(sockets_of(case))
    _save(folder / "truth.blend")
    _default_material()
    _set_material(start_of(case))
    _save(folder / "start.blend")
    if case.plant == "other_picture":
        other = replace(
            case, number=case.number + 1000, plant="", shape="monkey" if case.shape != "monkey" else "torus"
        )
        _scene(other)
        _set_material(sockets_of(other))
    else:
        _scene(case)
        _set_material(sockets_of(case))
        _plant(case)
    _render(case, folder / "reference.exr", seed=0)
    bpy.context.scene.cycles.samples = case.judge_samples
    bpy.context.scene.cycles.use_denoising = bpy.context.scene.cycles.use_adaptive_sampling = False
    _render(case, folder / "floor.exr", seed=1)


def _scene(case: Case) -> None:
    """Camera, floor, target, two things beside it and the light; Blender's material on the target."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    draw = random.Random(case.number)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", case.samples
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = case.denoised
    scene.render.resolution_x = scene.render.resolution_y = case.size
    scene.render.resolution_percentage = 100
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.view_settings.view_transform = "AgX" if case.picture == "png" else "Standard"
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -6.0, 2.3), (math.radians(74), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_plane_add(size=9.0)
    _coloured(bpy.context.object, "Floor", (0.35, 0.33, 0.3))
    for name, place in (("Left", (-1.9, 1.2, 0.6)), ("Right", (2.0, 1.6, 0.6))):
        bpy.ops.mesh.primitive_cube_add(size=1.2, location=place, rotation=(0.0, 0.0, draw.uniform(0.0, 1.5)))
        _coloured(bpy.context.object, name, tuple(draw.uniform(0.1, 0.7) for _ in range(3)))
    _target(case, draw)
    _light(case, draw)


def _target(case: Case, draw: random.Random) -> None:
    if case.shape == "ball":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=1.05, location=(0.0, 0.0, 1.1))
    elif case.shape == "torus":
        bpy.ops.mesh.primitive_torus_add(
            major_segments=96, minor_segments=48, major_radius=0.85, minor_radius=0.38, location=(0.0, 0.0, 1.15),
            rotation=(math.radians(70), 0.0, draw.uniform(-0.5, 0.5)),
        )  # fmt: skip
    else:
        bpy.ops.mesh.primitive_monkey_add(
            size=2.1, location=(0.0, 0.0, 1.15), rotation=(-0.2, 0.0, draw.uniform(-0.5, 0.5))
        )
        subdivision = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
        subdivision.levels = subdivision.render_levels = 3
    target = bpy.context.object
    target.name = TARGET
    for polygon in target.data.polygons:
        polygon.use_smooth = True
    target.data.materials.append(bpy.data.materials.new(TARGET))
    bpy.context.view_layer.objects.active = target


def _light(case: Case, draw: random.Random) -> None:
    scene = bpy.context.scene
    world = scene.world = bpy.data.worlds.new("World")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    if case.light == "probe":
        _probe(world, background, draw)
        return
    level = draw.uniform(0.05, 0.3)
    background.inputs["Color"].default_value = (level, level, level, 1.0)
    data = bpy.data.lights.new("Lamp", case.light.upper())
    data.energy = {"point": 900.0, "area": 700.0, "sun": 4.0}[case.light]
    if case.light == "area":
        data.shape, data.size = "SQUARE", draw.uniform(0.8, 2.5)
    elif case.light == "point":
        data.shadow_soft_size = draw.uniform(0.05, 0.4)
    else:
        data.angle = math.radians(draw.uniform(0.5, 8.0))
    lamp = bpy.data.objects.new("Lamp", data)
    scene.collection.objects.link(lamp)
    _turn_lamp(lamp, draw.uniform(-0.8, 0.8))


def _turn_lamp(lamp: bpy.types.Object, turn: float) -> None:
    lamp["turn"] = turn
    lamp.location = (3.2 * math.sin(turn), -3.2 * math.cos(turn), 4.0)
    lamp.rotation_euler = (math.atan2(3.2, 3.0), 0.0, turn)


def _probe(world: bpy.types.World, background: bpy.types.Node, draw: random.Random) -> None:
    """One of the environment maps that come with Blender."""
    names = ("city", "courtyard", "forest", "interior", "studio", "sunrise", "sunset")
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    environment = nodes.new("ShaderNodeTexEnvironment")
    environment.image = bpy.data.images.load(str(folder / f"{draw.choice(names)}.exr"))
    environment.image.pack()
    mapping.inputs["Rotation"].default_value[2] = draw.uniform(0.0, 2.0 * math.pi)
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    links.new(environment.outputs["Color"], background.inputs["Color"])


def _plant(case: Case) -> None:
    """Change what the export of start.blend cannot know."""
    scene, objects, plant = bpy.context.scene, bpy.data.objects, case.plant
    assert plant in ("", *PLANTS)
    if plant == "lamp_level":
        objects["Lamp"].data.energy *= LEVEL
    elif plant == "lamp_moved":
        turn = objects["Lamp"]["turn"]
        _turn_lamp(objects["Lamp"], turn - math.copysign(LAMP_TURN, turn))
    elif plant == "probe_rotated":
        mapping = next(node for node in scene.world.node_tree.nodes if node.type == "MAPPING")
        mapping.inputs["Rotation"].default_value[2] += PROBE_TURN
    elif plant == "camera_shift":
        scene.camera.data.shift_x = SHIFT_PIXELS / case.size
    elif plant == "missing_object":
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.55, location=(1.2, -0.9, 0.55))
        _coloured(bpy.context.object, "Missing", (0.8, 0.05, 0.05))
    elif plant == "missing_texture":
        tree = bpy.data.materials[TARGET].node_tree
        texture = tree.nodes.new("ShaderNodeTexChecker")
        texture.inputs["Scale"].default_value = 6.0
        base = _principled().inputs["Base Color"]
        texture.inputs["Color1"].default_value = base.default_value
        texture.inputs["Color2"].default_value = (*(0.3 * c for c in base.default_value[:3]), 1.0)
        tree.links.new(texture.outputs["Color"], base)
    elif plant == "volume":
        bpy.ops.mesh.primitive_cube_add(size=7.0, location=(0.0, 0.0, 2.0))
        fog = bpy.data.materials.new("Fog")
        scatter = fog.node_tree.nodes.new("ShaderNodeVolumeScatter")
        scatter.inputs["Density"].default_value = 0.12
        output = next(node for node in fog.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
        fog.node_tree.links.remove(output.inputs["Surface"].links[0])
        fog.node_tree.links.new(scatter.outputs["Volume"], output.inputs["Volume"])
        bpy.context.object.data.materials.append(fog)


def _coloured(item: bpy.types.Object, name: str, colour: tuple[float, ...]) -> None:
    item.name = name
    material = bpy.data.materials.new(name)
    item.data.materials.append(material)
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (*colour, 1.0)


def _principled() -> bpy.types.Node:
    return next(n for n in bpy.data.materials[TARGET].node_tree.nodes if n.type == "BSDF_PRINCIPLED")


def _set_material(sockets: dict[str, Any]) -> None:
    for name, value in sockets.items():
        _principled().inputs[name].default_value = value


def _default_material() -> None:
    """Blender's own Principled on the target again."""
    target = bpy.data.objects[TARGET]
    bpy.data.materials.remove(bpy.data.materials[TARGET])
    target.data.materials.clear()
    target.data.materials.append(bpy.data.materials.new(TARGET))


def _save(path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)


def _render(case: Case, path: Path, seed: int) -> None:
    scene = bpy.context.scene
    scene.cycles.seed = seed
    bpy.ops.render.render()
    settings = scene.render.image_settings
    picture = bpy.data.images["Render Result"]
    if case.picture == "png" and seed == 0:
        settings.media_type, settings.file_format, settings.color_mode = "IMAGE", "PNG", "RGB"
        picture.save_render(str(path.with_suffix(".png")), scene=scene)
    settings.media_type, settings.file_format, settings.color_mode = "IMAGE", "OPEN_EXR", "RGB"
    settings.color_depth = "32"
    picture.save_render(str(path), scene=scene)


def main() -> None:
    """Build."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=tuple(KINDS))
    parser.add_argument("number", type=int)
    parser.add_argument("folder", type=Path)
    chosen = parser.parse_args()
    build(KINDS[chosen.kind](chosen.number), chosen.folder.absolute())
    print("\n" + json.dumps({"object": TARGET}), flush=True)


if __name__ == "__main__":
    main()
