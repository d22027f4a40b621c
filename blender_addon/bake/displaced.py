# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the displacement of its materials moves the faces of an object, baked by the Blender this runs in."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.meshes.read_mesh import corners_of, flat_normals, material_of_slot, slot_count
from ..export.nodes.dependence import asked_of_place
from ..export.nodes.displacement import bends_normals, displacement_of, moves_faces
from ..versions import active_output, bends_flat_faces_as_smooth
from .stage import Stage, bake, staged

Corners = NDArray[np.float64]  # (corners of faces, 3)

COLORS, PLACE, GLOW = "material_fit", "material_fit_place", "material_fit_glow"


def displaced_corners(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph, folder: Path
) -> dict[str, Any]:
    """Write `positions` and `normals` of all triangles of an instance's object into `folder`, in the object's space.

    Both are float32 (triangles, 3, 3), normals of any length, as Cycles has them after the displacement. `rounded`
    (triangles,) says which of the triangles are flat and have the normals of smooth ones.
    """
    moved = moved_corners(scene, instance, depsgraph)
    for name, values in moved._asdict().items():
        np.save(folder / f"{name}.npy", values)
    return {name: f"{name}.npy" for name in moved._fields}


class Moved(NamedTuple):
    """What `displaced_corners` writes, and which triangles have other normals than that of their plane."""

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    rounded: NDArray[np.bool_]
    has_own: NDArray[np.bool_]


def moved_corners(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph
) -> Moved:
    """Positions and normals of `displaced_corners`.

    Cycles makes normals anew where a material moves faces alone. Where it bends normals, too, they are those of before
    (`GeometryManager::displace`, in 4.2 as in 5.2).
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
            moving = [shown.original for shown in slots if shown is not None and moves_faces(shown.original)]
            matrix = instance.matrix_world.copy()  # the item's own is not read as it is before Blender 5
            if not any(asked_of_place(material.node_tree) for material in moving):
                # far from zero the kernel's places are coarse
                matrix = stage.item.matrix_world = matrix.to_3x3().to_4x4()
            _keep_places(mesh, np.array(matrix, dtype=np.float64))
            stage.scene.cycles.samples = 1
            offsets = _baked(stage, materials, "up") - _baked(stage, materials, "down")
            _, _, was_smooth = corners_of(mesh)
            bent = np.array([shown is not None and _does_both(shown.original) for shown in slots])
            normals = _normals(stage, materials, bent)
            linear = np.array(instance.matrix_world.to_3x3(), dtype=np.float64)
            places, loops, is_smooth = corners_of(mesh)
            offsets, normals = offsets @ np.linalg.pinv(linear).T, normals @ linear
            moved = (places + offsets[loops].reshape(-1, 3, 3)).astype(np.float32)
            has_custom = bool(mesh.has_custom_normals)
            has_own = is_smooth | has_custom
            found = np.where(has_own[:, None, None], normals[loops].reshape(-1, 3, 3), flat_normals(moved))
            return Moved(moved, found.astype(np.float32), is_smooth & ~(was_smooth | has_custom), has_own)
    finally:
        for material in materials:
            bpy.data.materials.remove(material)


def _keep_places(mesh: Any, matrix: NDArray[np.float64]) -> None:
    """Give the mesh its places in the world before anything moves them, as an attribute."""
    places = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    places = places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    attribute = mesh.attributes.new(PLACE, "FLOAT_VECTOR", "POINT")
    attribute.data.foreach_set("vector", places.astype(np.float32).ravel())


def _displacing(material: bpy.types.Material | None) -> bpy.types.Material:
    """A surface that glows by what `_baked` asks for, with what moves the faces of `material`, if anything does."""
    if material is None or not moves_faces(material.original):
        copy = bpy.data.materials.new("material_fit_blank")
        if copy.node_tree is None:  # before Blender 5
            copy.use_nodes = True
    else:
        copy = material.original.copy()
        copy.displacement_method = "DISPLACEMENT"  # without what bends normals besides
    tree: Any = copy.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.name = GLOW
    output: Any = active_output(tree)
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    _add_colors(tree)
    return copy


def _normals(stage: Stage, materials: list[bpy.types.Material], bent: NDArray[np.bool_]) -> Corners:
    """Normals at the corners of the faces; in slots whose materials have `bent` them, too, those of before anything
    moved, on flat faces those of smooth ones where Cycles bends these."""
    mesh: Any = stage.item.data
    slots, smooth, corners = (np.empty(len(mesh.polygons), dtype=kind) for kind in (np.int32, np.bool_, np.int32))
    for name, values in (("material_index", slots), ("use_smooth", smooth), ("loop_total", corners)):
        mesh.polygons.foreach_get(name, values)
    is_bent = bent[slots]
    if bends_flat_faces_as_smooth():
        mesh.polygons.foreach_set("use_smooth", smooth | is_bent)
    for material in np.array(materials)[bent]:
        _keep_still(material)
    found = 2.0 * _baked(stage, materials, "normal") - 1.0
    if bent.any() and sum(map(_keep_still, materials)):
        of_before = 2.0 * _baked(stage, materials, "normal") - 1.0
        found = np.where(np.repeat(is_bent, corners)[:, None], of_before, found)
    return found


def _does_both(material: bpy.types.Material) -> bool:
    """Whether a material moves faces and bends normals, too."""
    return moves_faces(material) and bends_normals(material)


def _keep_still(material: bpy.types.Material) -> bool:
    """Take away what displaces a material of `_displacing`, and return whether anything did."""
    displacement: Any = displacement_of(material)
    if displacement is not None:
        displacement.id_data.links.remove(displacement.links[0])
    return displacement is not None


def _add_colors(tree: Any) -> None:
    """What may be asked for, none of it below zero, as no emission is: half of the normal and a half, and how far a
    point has moved along the axes of the world and against them."""
    geometry, before = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeAttribute")
    before.attribute_name = PLACE
    half = tree.nodes.new("ShaderNodeVectorMath")
    half.name, half.operation = "normal", "MULTIPLY_ADD"
    half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(geometry.outputs["Normal"], half.inputs[0])
    for name, first, second in (
        ("up", geometry.outputs["Position"], before.outputs["Vector"]),
        ("down", before.outputs["Vector"], geometry.outputs["Position"]),
    ):
        difference, positive = (tree.nodes.new("ShaderNodeVectorMath") for _ in range(2))
        difference.operation, positive.operation, positive.name = "SUBTRACT", "MAXIMUM", name
        tree.links.new(first, difference.inputs[0])
        tree.links.new(second, difference.inputs[1])
        tree.links.new(difference.outputs[0], positive.inputs[0])
        positive.inputs[1].default_value = (0.0, 0.0, 0.0)


def _baked(stage: Stage, materials: list[bpy.types.Material], color: str) -> Corners:
    """One of the colours of `_add_colors` at the corners of the faces."""
    mesh: Any = stage.item.data
    for material in materials:
        tree: Any = material.node_tree
        tree.links.new(tree.nodes[color].outputs[0], tree.nodes[GLOW].inputs["Color"])
    colors = mesh.color_attributes.new(COLORS, "FLOAT_COLOR", "CORNER")
    name = colors.name  # another one where the mesh has such an attribute
    try:
        mesh.color_attributes.active_color = colors
        stage.scene.render.bake.target = "VERTEX_COLORS"
        bake(stage, "EMIT")
        found = np.empty(len(mesh.loops) * 4, dtype=np.float32)
        mesh.color_attributes[name].data.foreach_get("color", found)
        return found.reshape(-1, 4)[:, :3].astype(np.float64)
    finally:
        mesh.color_attributes.remove(mesh.color_attributes[name])
