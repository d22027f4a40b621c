# SPDX-License-Identifier: Apache-2.0
"""Many small things over a floor, each of a material of its own: what a queue is for. Run by a Python with `bpy`."""

from __future__ import annotations

import math
import random
from typing import Any

import bpy
from mathutils import Vector  # pyright: ignore[reportMissingImports]  # part of bpy

from .lights import grey_world, light, look_at

IN_A_ROW = 10
APART = 1.0  # between the middles of two things
SHARE = 0.62  # of the way from one row to the next in the picture
BACK = 20.0  # of the camera from the middle


def put_up(draw: random.Random, count: int, size: int) -> list[str]:
    """Build the things in rows, lights and a camera in the empty scene; the names of the things.

    The picture is `size` pixels wide and as high as the rows need.
    """
    rows = math.ceil(count / IN_A_ROW)
    _floor(IN_A_ROW + 4.0, rows + 4.0)
    names = []
    for k in range(count):
        place = ((k % IN_A_ROW - (IN_A_ROW - 1) / 2) * APART, (k // IN_A_ROW - (rows - 1) / 2) * APART, 0.0)
        names.append(_thing(f"Thing {k + 1:02}", draw.choice(list(_KINDS)), Vector(place), draw.uniform(0.0, 3.0)))
    _lights(draw)
    scene = bpy.context.scene
    scene.render.resolution_x = size
    scene.render.resolution_y = math.ceil(size * (rows + 1) * SHARE / (IN_A_ROW + 1))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", (IN_A_ROW + 1) * APART
    camera.location = BACK * Vector((0.0, -math.sqrt(1.0 - SHARE**2), SHARE)) + Vector((0.0, 0.0, 0.3))
    camera.rotation_euler = (math.acos(SHARE), 0.0, 0.0)
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    return names


def drawn_thing(_: str, draw: random.Random) -> dict[str, Any]:
    """What a picture of few hundred pixels can tell: colour, roughness, and whether it is a metal."""
    return {
        "Base Color": (*(draw.uniform(0.08, 0.85) for _ in range(3)), 1.0),
        "Roughness": draw.uniform(0.2, 0.7),
        "Metallic": draw.choice([0.0, 0.0, 1.0]),
    }


def _ball() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.36, location=(0.0, 0.0, 0.37))


def _box() -> None:
    bpy.ops.mesh.primitive_cube_add(size=0.55, location=(0.0, 0.0, 0.285))


def _cone() -> None:
    bpy.ops.mesh.primitive_cone_add(vertices=48, radius1=0.38, depth=0.7, location=(0.0, 0.0, 0.36))


def _ring() -> None:
    bpy.ops.mesh.primitive_torus_add(
        major_segments=96, minor_segments=48, major_radius=0.27, minor_radius=0.12, location=(0.0, 0.0, 0.13)
    )


def _can() -> None:
    bpy.ops.mesh.primitive_cylinder_add(vertices=48, radius=0.3, depth=0.55, location=(0.0, 0.0, 0.285))


_KINDS = {"ball": _ball, "box": _box, "cone": _cone, "ring": _ring, "can": _can}


def _thing(name: str, kind: str, place: Vector, turn: float) -> str:
    _KINDS[kind]()
    item = bpy.context.object
    item.name, item.location, item.rotation_euler = name, item.location + place, (0.0, 0.0, turn)
    for polygon in item.data.polygons:
        polygon.use_smooth = kind in ("ball", "ring")
    return item.name


def _floor(width: float, depth: float) -> None:
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    item = bpy.context.object
    item.name, item.scale = "Floor", (width, depth, 1.0)
    item.data.materials.append(bpy.data.materials.new("Floor"))


def _lights(draw: random.Random) -> None:
    grey_world(draw.uniform(0.1, 0.3))
    energy, size = draw.uniform(450.0, 900.0), draw.uniform(1.5, 4.0)
    lamp = light("Lamp", "AREA", energy, (draw.uniform(-5.0, 5.0), -4.0, 6.5))
    lamp.data.size = size
    look_at(lamp, (0.0, 0.0, 0.0))
