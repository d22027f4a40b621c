# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the displacement of its materials moves the faces of an object, baked by the Blender this runs in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.meshes.read_mesh import corners_of, flat_normals, material_of_slot, slot_count
from ..export.nodes.displacement import displacement_of, moves_faces
from ..versions import active_output
from .stage import Stage, bake, staged

Corners = NDArray[np.float64]  # (corners of faces, 3)

COLORS = "material_fit"


def displaced_corners(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph, folder: Path
) -> dict[str, Any]:
    """Write `positions` and `normals` of all triangles of an instance's object into `folder`, in the object's space.

    Both are float32 (triangles, 3, 3), normals of any length, as Cycles has them after the displacement: it moves
    vertices and makes normals anew.
    """
    materials: list[bpy.types.Material] = []
    try:
        with staged(scene, instance, depsgraph) as stage:
            mesh: Any = stage.item.data
            slots = [material_of_slot(instance.object, number) for number in range(max(slot_count(instance.object), 1))]
            faces = np.empty(len(mesh.polygons), dtype=np.int32)
            mesh.polygons.foreach_get("material_index", faces)
            mesh.materials.clear()
            for shown in slots:
                materials.append(_displacing(shown))
                mesh.materials.append(materials[-1])
            mesh.polygons.foreach_set("material_index", np.clip(faces, 0, len(slots) - 1))  # clear() has set them to 0
            stage.scene.cycles.samples = 1
            after, normals = _baked(stage, "POSITION"), 2.0 * _baked(stage, "EMIT") - 1.0
            for material in materials:
                _take_away(material)
            before = _baked(stage, "POSITION")  # which is not quite at the corners, either
            linear = np.array(instance.matrix_world.to_3x3(), dtype=np.float64)
            places, loops, is_smooth = corners_of(mesh)
            offsets, normals = (after - before) @ np.linalg.pinv(linear).T, normals @ linear
            moved = (places + offsets[loops].reshape(-1, 3, 3)).astype(np.float32)
            has_own = is_smooth | bool(mesh.has_custom_normals)
            found = np.where(has_own[:, None, None], normals[loops].reshape(-1, 3, 3), flat_normals(moved))
            np.save(folder / "positions.npy", moved)
            np.save(folder / "normals.npy", found.astype(np.float32))
            return {"positions": "positions.npy", "normals": "normals.npy"}
    finally:
        for material in materials:
            bpy.data.materials.remove(material)


def _displacing(material: bpy.types.Material | None) -> bpy.types.Material:
    """A surface that gives half of its normal and a half, with what moves the faces of `material`, if anything does."""
    if material is None or not moves_faces(material.original):
        copy = bpy.data.materials.new("material_fit_blank")
        if copy.node_tree is None:  # before Blender 5
            copy.use_nodes = True
    else:
        copy = material.original.copy()
        copy.displacement_method = "DISPLACEMENT"  # without what bends normals besides
    tree: Any = copy.node_tree
    half, emission = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("ShaderNodeEmission")
    half.operation = "MULTIPLY_ADD"
    half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], half.inputs[0])
    tree.links.new(half.outputs[0], emission.inputs["Color"])
    output: Any = active_output(tree)
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return copy


def _take_away(material: bpy.types.Material) -> None:
    socket = displacement_of(material)
    if socket is not None:
        material.node_tree.links.remove(socket.links[0])


def _baked(stage: Stage, kind: str) -> Corners:
    """One pass at the corners of the faces."""
    mesh: Any = stage.item.data
    colors = mesh.color_attributes.new(COLORS, "FLOAT_COLOR", "CORNER")
    try:
        mesh.color_attributes.active_color = colors
        stage.scene.render.bake.target = "VERTEX_COLORS"
        bake(stage, kind)
        found = np.empty(len(colors.data) * 4, dtype=np.float32)
        mesh.color_attributes[COLORS].data.foreach_get("color", found)
        return found.reshape(-1, 4)[:, :3].astype(np.float64)
    finally:
        mesh.color_attributes.remove(mesh.color_attributes[COLORS])
