# SPDX-License-Identifier: GPL-3.0-or-later
"""A UV map of its own for the faces of one material slot, without overlap, made by the Blender this runs in."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

ANGLE = 1.15  # radians; Blender's own default for Smart UV Project is 66 degrees
# Around each island, in texels. Twice that lies between two of them: of the texels between, the nearest to a border,
# which filtering looks at, is filled from that island alone. At 1.25 some of sixteen boxes are means of two faces; at
# the 0.2 of Blender's SCALED margin of 0.004 the edges of a bumped box were 9 % of its block too bright.
ISLAND_MARGIN = 1.5


def unwrapped(mesh: bpy.types.Mesh, slots: NDArray[np.bool_], scene: bpy.types.Scene, size: int) -> NDArray[np.float32]:
    """Return UV (corners, 2) of the polygons in `slots` (polygons,) for `size` texels a side; those of others are 0.

    Works on a copy of `mesh`, linked to `scene`, which must be that of the window.
    """
    copy = mesh.copy()
    item = bpy.data.objects.new("material_fit_unwrap", copy)
    try:
        while len(copy.uv_layers) > 0:
            copy.uv_layers.remove(copy.uv_layers[0])
        layer = copy.uv_layers.new(name="material_fit", do_init=False)
        copy.uv_layers.active = layer
        scene.collection.objects.link(item)
        view_layer = bpy.context.view_layer
        view_layer.objects.active = item
        item.select_set(True)
        scene.tool_settings.mesh_select_mode = (False, False, True)
        bpy.ops.object.mode_set(mode="EDIT")
        shown = bmesh.from_edit_mesh(copy)
        for face in shown.faces:
            face.hide_set(False)
            face.select_set(False)
        for face, chosen in zip(shown.faces, slots, strict=True):
            if chosen:
                face.select_set(True)
        bmesh.update_edit_mesh(copy)
        bpy.ops.uv.smart_project(
            angle_limit=ANGLE, margin_method="FRACTION", island_margin=ISLAND_MARGIN / size, correct_aspect=False
        )
        bpy.ops.object.mode_set(mode="OBJECT")
        uv = np.zeros(len(copy.loops) * 2, dtype=np.float32)
        copy.uv_layers.active.uv.foreach_get("vector", uv)
    finally:
        bpy.data.objects.remove(item)
        bpy.data.meshes.remove(copy)
    totals = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_total", totals)
    return np.where(np.repeat(slots, totals)[:, None], uv.reshape(-1, 2), 0.0).astype(np.float32)
