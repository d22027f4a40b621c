# SPDX-License-Identifier: Apache-2.0
"""Lights of the rooms and floors of this study, in the scene that is open. Run by a Python with `bpy`."""

from __future__ import annotations

import bpy
from mathutils import Vector  # pyright: ignore[reportMissingImports]  # part of bpy

Place = tuple[float, float, float]


def grey_world(level: float) -> None:
    """Give the scene a world of one grey radiance."""
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (level, level, level, 1.0)


def light(name: str, kind: str, energy: float, place: Place) -> bpy.types.Object:
    """A new light, shining down."""
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    lamp = bpy.data.objects.new(name, data)
    lamp.location = place
    bpy.context.collection.objects.link(lamp)
    return lamp


def look_at(item: bpy.types.Object, place: Place) -> None:
    """Turn a light or a camera to a place."""
    item.rotation_euler = (Vector(place) - item.location).to_track_quat("-Z", "Y").to_euler()
