# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera or the light of the further picture that a fit proposes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import bpy
from mathutils import Matrix, Vector  # pyright: ignore[reportMissingImports]

from .job_result import NextPicture

_FLAGS = ("exclude", "holdout", "indirect_only", "hide_viewport")  # of a collection in a view layer


def turned_camera(scene: bpy.types.Scene, source: bpy.types.Object, proposed: NextPicture) -> bpy.types.Object:
    """A copy of a camera at the proposed turn, in the scene."""
    camera = bpy.data.objects.new(f"{source.name} turned {proposed.turn:.0f}", source.data.copy())
    scene.collection.objects.link(camera)
    camera.matrix_world = _turned(proposed, proposed.turn) @ source.matrix_world
    return camera


def scene_with_light(scene: bpy.types.Scene, proposed: NextPicture) -> bpy.types.Scene:
    """A scene of the same objects under the proposed light; the scene itself stays as it is."""
    light = scene.objects[proposed.light]
    other = scene.copy()
    other.use_extra_user = True  # as every scene of Blender's own has: without it no file would keep it
    other.mfo.pictures.clear()
    replaced: dict[bpy.types.Object, bpy.types.Object | None]
    if proposed.light_turn:
        other.name = f"{scene.name}, {light.name} turned {proposed.light_turn:.0f}"
        moved = light.copy()
        moved.parent = None
        moved.constraints.clear()
        moved.animation_data_clear()
        moved.matrix_world = _turned(proposed, proposed.light_turn) @ light.matrix_world
        replaced = {light: moved}
    else:
        other.name = f"{scene.name}, {light.name} alone"
        other.world = None
        replaced = {each: None for each in scene.objects if each.type == "LIGHT" and each != light}
    copies = _replace(other.collection, replaced)
    for before, after in zip(scene.view_layers, other.view_layers, strict=True):
        _keep_flags(before.layer_collection, after.layer_collection, copies)
    return other


def _replace(
    collection: bpy.types.Collection, replaced: Mapping[bpy.types.Object, bpy.types.Object | None]
) -> dict[str, str]:
    """Put objects in place of others, below a collection that is the scene's own.

    Collections that hold any are copied. Returns the copies' names with those of what they are copies of.
    """
    copies: dict[str, str] = {}
    for old, new in replaced.items():
        if collection.objects.get(old.name) == old:
            collection.objects.unlink(old)
            if new is not None:
                collection.objects.link(new)
    for child in list(collection.children):
        if any(child.all_objects.get(old.name) == old for old in replaced):
            copy = child.copy()
            collection.children.unlink(child)
            collection.children.link(copy)
            copies |= {copy.name: child.name} | _replace(copy, replaced)
    return copies


def _keep_flags(before: bpy.types.LayerCollection, after: bpy.types.LayerCollection, copies: Mapping[str, str]) -> None:
    """What a view layer does to collections, as it was before some were copied."""
    for child in after.children:
        source = before.children.get(copies.get(child.name, child.name))
        if source is None:
            continue
        if child.name in copies:
            for flag in _FLAGS:
                setattr(child, flag, getattr(source, flag))
        _keep_flags(source, child, copies)


def _turned(proposed: NextPicture, degrees: float) -> Matrix:
    """A turn around the vertical through the object."""
    center = Vector(proposed.center)
    turn = Matrix.Rotation(math.radians(degrees), 4, "Z")
    return Matrix.Translation(center) @ turn @ Matrix.Translation(-center)
