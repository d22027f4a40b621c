# SPDX-License-Identifier: GPL-3.0-or-later
"""Which material slots cameras see, by rays through the picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import bpy
from mathutils import Vector  # pyright: ignore[reportMissingImports]

from ..fitted_slot import FittedSlot
from ..nodes.target_shader import target_shader
from ..render_state import rendered_objects

ACROSS = 96  # rays along the longer side of the picture; what is missed is smaller than one of them


def seen_slots(context: bpy.types.Context, views: Sequence[tuple[bpy.types.Object, int]] = ()) -> list[FittedSlot]:
    """The slots with materials that can be fitted, each material once, those that cover most first.

    `views` are cameras and frames, instead of the scene's own as it is.
    """
    scene = context.scene
    now = scene.frame_current, scene.frame_subframe
    hits: Counter[tuple[bpy.types.Object, int]] = Counter()
    try:
        for camera, frame in views:
            if (scene.frame_current, scene.frame_subframe) != (frame, 0.0):
                scene.frame_set(frame)
            hits += _hits(context, camera)
    finally:
        if (scene.frame_current, scene.frame_subframe) != now:
            scene.frame_set(now[0], subframe=now[1])
    if not views and scene.camera is not None and scene.camera.type == "CAMERA":
        hits = _hits(context, scene.camera)
    slots: dict[str, FittedSlot] = {}
    for (obj, slot), _ in hits.most_common():
        each = FittedSlot(obj, slot)
        if each.material is not None and target_shader(each.material) is not None:
            slots.setdefault(each.material.name_full, each)
    return list(slots.values())


def _hits(context: bpy.types.Context, camera: bpy.types.Object) -> Counter[tuple[bpy.types.Object, int]]:
    """How many rays of a camera meet each slot of the objects that a render shows."""
    scene, depsgraph = context.scene, context.evaluated_depsgraph_get()
    rendered = rendered_objects(context.view_layer)
    hits: Counter[tuple[bpy.types.Object, int]] = Counter()
    for origin, direction in _rays(scene, camera):
        found, _, _, face, item, _ = scene.ray_cast(depsgraph, origin, direction)
        if not found or item.original.name_full not in rendered:
            continue
        polygons = getattr(item.evaluated_get(depsgraph).data, "polygons", ())
        slot = polygons[face].material_index if 0 <= face < len(polygons) else item.original.active_material_index
        hits[item.original, min(slot, max(len(item.original.material_slots) - 1, 0))] += 1
    return hits


def _rays(scene: bpy.types.Scene, camera: bpy.types.Object) -> list[tuple[Vector, Vector]]:
    """Origin and direction of rays through the frame, of perspective and orthographic cameras."""
    frame = camera.data.view_frame(scene=scene)  # right top, right bottom, left bottom, left top
    top, right, down = frame[3], frame[0] - frame[3], frame[2] - frame[3]
    wide = right.length >= down.length
    columns = ACROSS if wide else max(int(ACROSS * right.length / down.length), 1)
    rows = max(int(ACROSS * down.length / right.length), 1) if wide else ACROSS
    matrix, turn = camera.matrix_world, camera.matrix_world.to_3x3()
    rays = []
    for row in range(rows):
        for column in range(columns):
            point = top + right * ((column + 0.5) / columns) + down * ((row + 0.5) / rows)
            if camera.data.type == "ORTHO":
                begin, along = Vector((point.x, point.y, 0.0)), Vector((0.0, 0.0, -1.0))
            else:
                begin, along = Vector((0.0, 0.0, 0.0)), point.normalized()
            direction = (turn @ along).normalized()
            rays.append((matrix @ begin + direction * camera.data.clip_start, direction))
    return rays
