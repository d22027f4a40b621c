# SPDX-License-Identifier: Apache-2.0
"""The scenes of `studies.views`, run by a Python with `bpy`.

    python -m studies.views.scene build NUMBER FOLDER --size PIXELS
    python -m studies.views.scene render FOLDER CAMERA FILE [--scene SCENE] [--moved]

`build` writes truth.blend, its values in truth.json, and start.blend, with the camera Front and its turns T030 to T330
around the target, and scenes whose lamp is turned likewise, L090 to L270, or alone, L000; `render` shows the truth from
one of the cameras in one of the scenes, with `--moved` under a lamp that is elsewhere.
"""

from __future__ import annotations

import argparse
import json
import math
import random
from pathlib import Path

import bpy
from mathutils import Matrix, Vector  # pyright: ignore[reportMissingImports]  # part of bpy

TARGET, CENTER = "Target", Vector((0.0, 0.0, 1.1))
TURNS, LAMP_TURNS = range(30, 360, 30), (0, 90, 180, 270)
SAMPLES = 128
MOVED = 1.1  # radians that the lamp is turned by


def build(number: int, folder: Path, size: int) -> None:
    """Write both files, whose pictures have `size` pixels along a side."""
    folder.mkdir(parents=True, exist_ok=True)
    draw = random.Random(number)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", SAMPLES
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    _material(bpy.context.object, "Floor")["Base Color"].default_value = (0.35, 0.33, 0.3, 1.0)
    if number % 2:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=1.05, location=CENTER)
    else:
        bpy.ops.mesh.primitive_monkey_add(size=2.1, location=CENTER, rotation=(-0.2, 0.0, draw.uniform(-0.5, 0.5)))
        levels = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
        levels.levels = levels.render_levels = 2
    target = bpy.context.object
    target.name = TARGET
    for polygon in target.data.polygons:
        polygon.use_smooth = True
    sockets = _material(target, TARGET)
    _lights(draw, ("POINT", "AREA", "SUN")[number % 3])
    front = _camera("Front", Matrix.Translation((0.0, -5.2, 2.4)) @ Matrix.Rotation(math.radians(76), 4, "X"))
    for turn in TURNS:
        around = Matrix.Translation(CENTER) @ Matrix.Rotation(math.radians(turn), 4, "Z") @ Matrix.Translation(-CENTER)
        _camera(f"T{turn:03d}", around @ front.matrix_world)
    scene.camera = front
    _other_light(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"), copy=True)
    truth = {
        "Base Color": (*(draw.uniform(0.05, 0.8) for _ in range(3)), 1.0),
        "Metallic": draw.choice([0.0, 0.0, 1.0]),
        "Roughness": draw.uniform(0.15, 0.6),
        "Specular IOR Level": draw.uniform(0.3, 0.8),
        "Coat Weight": draw.choice([0.0, draw.uniform(0.2, 0.9)]),
        "Coat Roughness": draw.uniform(0.03, 0.3),
        "Sheen Weight": draw.choice([0.0, draw.uniform(0.1, 0.5)]),
    }
    for name, value in truth.items():
        sockets[name].default_value = value
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "truth.blend"), copy=True)
    (folder / "truth.json").write_text(json.dumps({name.lower().replace(" ", "_"): v for name, v in truth.items()}))


def render(folder: Path, camera: str, file: Path, *, name: str, moved: bool) -> None:
    """Render the truth from a camera in a scene, the first one without a name."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "truth.blend"))
    scene = bpy.data.scenes[name] if name else bpy.context.scene
    scene.camera = scene.objects[camera]
    if moved:
        _place(scene.objects["Lamp"], scene.objects["Lamp"]["turn"] + MOVED)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.seed = sum(camera.encode())
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True, scene=scene.name)


def _other_light(scene: bpy.types.Scene) -> None:
    """Scenes of the same objects with the lamp turned about the target, and with it alone."""
    lamp = scene.objects["Lamp"]
    for degrees in LAMP_TURNS:
        other = scene.copy()
        other.use_extra_user = True  # else no file keeps it
        other.name = f"L{degrees:03d}"
        if not degrees:
            other.world = None
            continue
        around = Matrix.Translation(CENTER) @ Matrix.Rotation(math.radians(degrees), 4, "Z")
        moved = lamp.copy()
        moved.matrix_world = around @ Matrix.Translation(-CENTER) @ lamp.matrix_world
        other.collection.objects.unlink(lamp)
        other.collection.objects.link(moved)


def _lights(draw: random.Random, kind: str) -> None:
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    level = draw.uniform(0.03, 0.15)
    background.inputs["Color"].default_value = (level, level, level, 1.0)
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = {"POINT": 900.0, "AREA": 700.0, "SUN": 4.0}[kind]
    if kind == "AREA":
        data.size = draw.uniform(0.8, 2.5)
    elif kind == "POINT":
        data.shadow_soft_size = draw.uniform(0.05, 0.4)
    else:
        data.angle = math.radians(draw.uniform(0.5, 8.0))
    lamp = bpy.data.objects.new("Lamp", data)
    bpy.context.collection.objects.link(lamp)
    lamp["turn"] = draw.uniform(-1.2, 1.2)
    _place(lamp, lamp["turn"])


def _place(lamp: bpy.types.Object, turn: float) -> None:
    lamp.location = (3.2 * math.sin(turn), -3.2 * math.cos(turn), 4.0)
    lamp.rotation_euler = (math.atan2(3.2, 3.0), 0.0, turn)


def _camera(name: str, matrix: Matrix) -> bpy.types.Object:
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.data.lens = 60
    camera.matrix_world = matrix
    bpy.context.collection.objects.link(camera)
    bpy.context.view_layer.update()
    return camera


def _material(item: bpy.types.Object, name: str) -> bpy.types.NodeInputs:
    item.name = name
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    item.data.materials.append(material)
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("build")
    one.add_argument("number", type=int)
    one.add_argument("folder", type=Path)
    one.add_argument("--size", type=int, required=True)
    one = commands.add_parser("render")
    one.add_argument("folder", type=Path)
    one.add_argument("camera")
    one.add_argument("file", type=Path)
    one.add_argument("--scene", default="")
    one.add_argument("--moved", action="store_true")
    chosen = parser.parse_args()
    if chosen.command == "build":
        build(chosen.number, chosen.folder, chosen.size)
    else:
        render(chosen.folder, chosen.camera, chosen.file, name=chosen.scene, moved=chosen.moved)
