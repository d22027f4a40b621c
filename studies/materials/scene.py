# SPDX-License-Identifier: Apache-2.0
"""The rooms of `studies.materials`, run by a Python with `bpy`.

    python -m studies.materials.scene build NUMBER FOLDER [--size PIXELS] [--nodes | --things COUNT]
    python -m studies.materials.scene render FILE PICTURE SEED [--samples COUNT]

`build` writes truth.blend, start.blend and truth.json: a room of six materials, under a lamp in a shade and one or two
others. With `--nodes` each has a graph of `studies.graphs`, whose values are drawn, instead of those of sockets alone.
With `--things` it is that many small things over a floor instead, each of a material of its own.
`render` shows a file in Cycles.
"""

from __future__ import annotations

import argparse
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

from ..graphs.materials import GRAPHS
from ..graphs.values import FITTED, Drawn
from .lights import grey_world, light, look_at
from .shelf import drawn_thing, put_up

NODES = {"Floor": "ramp", "Walls": "bump", "Chest": "checker", "Ball": "hue", "Vase": "roughness", "Shade": "mixed"}
OBJECTS = ("Floor", "Walls", "Chest", "Ball", "Vase", "Shade")


def build(number: int, folder: Path, size: int, *, nodes: bool = False, things: int = 0) -> None:
    """Write both files and the truth; the picture is `size` pixels wide."""
    folder.mkdir(parents=True, exist_ok=True)
    draw = random.Random(number)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    if things:
        names = put_up(draw, things, size)
    else:
        names = list(OBJECTS)
        _room()
        _furniture(draw)
        _lights(draw)
        _camera()
    inputs = {name: _material(scene.objects[name], name) for name in names}
    if nodes:
        truth = _write_nodes(inputs, folder, draw)
    else:
        truth = _write_sockets(inputs, folder, draw, drawn_thing if things else _drawn_truth)
    (folder / "truth.json").write_text(json.dumps(truth), "utf-8")


def _write_sockets(
    inputs: dict[str, bpy.types.NodeInputs],
    folder: Path,
    draw: random.Random,
    drawn: Callable[[str, random.Random], dict[str, Any]],
) -> dict[str, Any]:
    """Write both files with values of sockets; returns the truth."""
    for name in inputs:
        for socket, value in _drawn_start(draw).items():
            inputs[name][socket].default_value = value
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"), copy=True)
    truth = {name: drawn(name, draw) for name in inputs}
    for name, sockets in truth.items():
        for socket, value in sockets.items():
            inputs[name][socket].default_value = value
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "truth.blend"), copy=True)
    return truth


def _write_nodes(inputs: dict[str, bpy.types.NodeInputs], folder: Path, draw: random.Random) -> dict[str, Any]:
    """The same with values inside nodes, and of sockets without a link."""
    drawn = {}
    for name, graph in NODES.items():
        material = bpy.data.materials[name]
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        GRAPHS[graph](material.node_tree, shader)
        drawn[name] = Drawn(bpy.context.scene.objects[name], shader, FITTED[graph])
    truth = {name: each.draw(draw) for name, each in drawn.items()}
    starts = {name: each.draw(draw, near=truth[name]) for name, each in drawn.items()}
    for file, values in (("truth", truth), ("start", starts)):
        for name, each in drawn.items():
            each.put(values[name])
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{file}.blend"), copy=True)
    return truth


def render(file: Path, picture: Path, seed: int, samples: int) -> None:
    """Render a file as it is."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    scene = bpy.context.scene
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.seed, scene.cycles.samples = seed, samples
    scene.render.filepath = str(picture)
    bpy.ops.render.render(write_still=True)


def _room() -> None:
    """A floor and three walls, open to the camera."""
    _mesh("Floor", [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [(0, 1, 2, 3)])
    corners = [(-3, -3), (-3, 3), (3, 3), (3, -3)]
    points = [(x, y, z) for z in (0.0, 3.4) for x, y in corners]
    _mesh("Walls", points, [(0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3)])


def _furniture(draw: random.Random) -> None:
    bpy.ops.mesh.primitive_cube_add(size=1.3, location=(-1.5, 0.9, 0.65), rotation=(0.0, 0.0, draw.uniform(0.2, 0.9)))
    bpy.context.object.name = "Chest"
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.7, location=(0.4, -0.6, 0.7))
    bpy.context.object.name = "Ball"
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=48, radius=0.5, location=(1.7, 0.4, 0.9))
    bpy.context.object.scale = (0.9, 0.9, 1.8)
    bpy.context.object.name = "Vase"
    bpy.ops.mesh.primitive_cone_add(
        vertices=64, radius1=0.75, radius2=0.35, depth=0.7, end_fill_type="NOTHING", location=(0.1, 1.3, 2.2)
    )
    bpy.context.object.name = "Shade"
    for name in ("Ball", "Vase", "Shade"):
        bpy.context.view_layer.objects.active = item = bpy.data.objects[name]
        for polygon in item.data.polygons:
            polygon.use_smooth = True


def _lights(draw: random.Random) -> None:
    grey_world(draw.uniform(0.05, 0.3))
    bulb = light("Bulb", "POINT", draw.uniform(60.0, 140.0), (0.1, 1.3, 2.2))
    bulb.data.shadow_soft_size = draw.uniform(0.08, 0.15)
    lamp = light("Lamp", "AREA", draw.uniform(150.0, 320.0), (draw.uniform(-2.0, 2.0), -2.4, 3.3))
    lamp.data.size = draw.uniform(0.6, 1.6)
    look_at(lamp, (0.0, 0.3, 0.6))


def _camera() -> None:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.data.lens = (0.0, -8.2, 2.5), 42.0
    look_at(camera, (0.0, 0.0, 1.35))
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def _drawn_start(draw: random.Random) -> dict[str, Any]:
    level = draw.uniform(0.3, 0.8)
    return {"Base Color": (level, level, level, 1.0), "Roughness": draw.uniform(0.3, 0.7)}


def _drawn_truth(name: str, draw: random.Random) -> dict[str, Any]:
    truth: dict[str, Any] = {
        "Base Color": (*(draw.uniform(0.08, 0.85) for _ in range(3)), 1.0),
        "Roughness": draw.uniform(0.2, 0.7),
        "Specular IOR Level": draw.uniform(0.3, 0.7),
    }
    if name in ("Chest", "Ball", "Vase"):
        truth["Metallic"] = draw.choice([0.0, 0.0, 1.0])
        truth["Coat Weight"] = draw.choice([0.0, 0.0, draw.uniform(0.3, 0.9)])
        truth["Sheen Weight"] = draw.choice([0.0, 0.0, draw.uniform(0.1, 0.5)])
    return truth


def _mesh(name: str, points: list[tuple[float, float, float]], faces: list[tuple[int, ...]]) -> None:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))


def _material(item: bpy.types.Object, name: str) -> bpy.types.NodeInputs:
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
    one.add_argument("--size", type=int, default=96)
    one.add_argument("--nodes", action="store_true")
    one.add_argument("--things", type=int, default=0)
    one = commands.add_parser("render")
    one.add_argument("file", type=Path)
    one.add_argument("picture", type=Path)
    one.add_argument("seed", type=int)
    one.add_argument("--samples", type=int, default=256)
    chosen = parser.parse_args()
    if chosen.command == "build":
        build(chosen.number, chosen.folder, chosen.size, nodes=chosen.nodes, things=chosen.things)
    else:
        render(chosen.file, chosen.picture, chosen.seed, chosen.samples)
