# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluated geometry of a Blender object, all modifiers applied."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import corner_normals, rounds_beside_flat_faces
from .mesh_arrays import CornerMesh, circling_tangents

MESH_TYPES = ("MESH", "CURVE", "SURFACE", "FONT", "META")  # of objects whose faces are rendered
Number = TypeVar("Number", np.int32, np.bool_)


def read_mesh(
    evaluated: bpy.types.Object, depsgraph: bpy.types.Depsgraph, axes: Sequence[str] = ()
) -> CornerMesh | None:
    """Return the triangles of an evaluated object in its own space, or None if it has no faces.

    Faces of a slot for which `axes` has one, X, Y or Z, have tangents that circle it.
    """
    # the data of an instance is what geometry nodes have made; of a mesh that is edited it is not complete, also where
    # another object edits it
    if isinstance(evaluated.data, bpy.types.Mesh) and not evaluated.data.is_editmode:
        return _corner_mesh(evaluated.data, axes) if len(evaluated.data.polygons) else None
    try:
        mesh = evaluated.to_mesh(preserve_all_data_layers=False, depsgraph=depsgraph)
    except RuntimeError:  # this type has no geometry that converts
        return None
    try:
        return _corner_mesh(mesh, axes) if mesh is not None and len(mesh.polygons) else None
    finally:
        evaluated.to_mesh_clear()


def material_of_slot(evaluated: bpy.types.Object, slot: int) -> bpy.types.Material | None:
    """Return the material Cycles gives slot `slot`: the object's where its slot says so, else the mesh's.

    The mesh's are those after all modifiers: geometry nodes may have set others than the object's slots show.
    """
    slots = evaluated.material_slots
    if slot < len(slots) and slots[slot].link == "OBJECT":
        return slots[slot].material
    materials = getattr(evaluated.data, "materials", ())
    if slot < len(materials):
        return materials[slot]
    return slots[slot].material if slot < len(slots) else None


def slot_count(evaluated: bpy.types.Object) -> int:
    """Return how many slots faces may name."""
    return max(len(evaluated.material_slots), len(getattr(evaluated.data, "materials", ())))


def _corner_mesh(mesh: bpy.types.Mesh, axes: Sequence[str]) -> CornerMesh:
    places, corners, is_smooth = corners_of(mesh)
    uvs = np.zeros(len(mesh.loops) * 2, dtype=np.float32)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is not None:
        layer.uv.foreach_get("vector", uvs)
    slots = _of_faces(mesh, "material_index", np.int32)[_faces(mesh)]
    return CornerMesh(
        positions=places,
        normals=_shading_normals(mesh, places, corners, is_smooth),
        uvs=uvs.reshape(-1, 2)[corners].reshape(-1, 3, 2),
        slots=slots,
        vertices=_vertex_of_corner(mesh)[corners].reshape(-1, 3),
        tangents=_tangents(mesh, places, slots, axes) if any(axes) else None,
    )


def _tangents(
    mesh: bpy.types.Mesh, places: NDArray[np.float32], slots: NDArray[np.int32], axes: Sequence[str]
) -> NDArray[np.float32]:
    """Tangents (triangles, 3, 3) of a mesh that no modifier deforms; zero for other slots."""
    middle, size = (np.array(each, np.float64) for each in (mesh.texspace_location, mesh.texspace_size))
    found = np.zeros_like(places)
    slots = np.clip(slots, 0, len(axes) - 1)
    for slot, axis in enumerate(axes):
        if axis:
            found[slots == slot] = circling_tangents(places[slots == slot], middle, size, axis)
    return found


def corners_of(mesh: bpy.types.Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.bool_]]:
    """Of a mesh's triangles the places (triangles, 3, 3), the corners of faces (3 a triangle), and which are smooth."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == len(mesh.polygons):  # each face is a triangle, whose corners follow each other
        corners = np.arange(count * 3, dtype=np.int32)
    else:
        corners = np.empty(count * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", corners)
    is_smooth = ~_of_faces(mesh, "sharp_face", np.bool_)[_faces(mesh)]
    if mesh.normals_domain == "FACE" and "sharp_face" not in mesh.attributes:  # as geometry nodes leave it
        is_smooth[:] = False
    positions = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", positions)
    places = positions.reshape(-1, 3)[_vertex_of_corner(mesh)[corners]].reshape(-1, 3, 3)
    return places, corners, is_smooth


# Attributes are copied whole, where the properties of faces and corners are asked one by one: of three million
# triangles 0.003 s for 0.4 s


def _vertex_of_corner(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    found = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", found)
    return found


def _faces(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """The face of each triangle."""
    found = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", found)
    return found


def _of_faces(mesh: bpy.types.Mesh, name: str, dtype: type[Number]) -> NDArray[Number]:
    """An attribute of the faces, which are all 0 where the mesh has none of that name."""
    found = np.zeros(len(mesh.polygons), dtype=dtype)
    attribute = mesh.attributes.get(name)
    if attribute is not None and attribute.domain == "FACE":
        attribute.data.foreach_get("value", found)
    return found


def _shading_normals(
    mesh: bpy.types.Mesh, places: NDArray[np.float32], corners: NDArray[np.int32], is_smooth: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Normals as Cycles takes them (measured with Blender 4.3, 5.0 and 5.2), at three corners a triangle.

    Each triangle of a flat face is flat by itself, also where the face is not plane, unless the mesh has custom
    normals. Faces that only sharp edges make flat are smooth, unless nothing was ever said of faces (`sharp_face`).
    """
    if mesh.normals_domain == "FACE" or (rounds_beside_flat_faces() and not _splits_vertices(mesh)):
        vertex_normals = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
        mesh.vertex_normals.foreach_get("vector", vertex_normals)
        normals = vertex_normals.reshape(-1, 3)[_vertex_of_corner(mesh)[corners]].reshape(-1, 3, 3)
    else:
        normals = corner_normals(mesh)[corners].reshape(-1, 3, 3)
    if not mesh.has_custom_normals:
        normals[~is_smooth] = flat_normals(places[~is_smooth])
    return normals


def _splits_vertices(mesh: bpy.types.Mesh) -> bool:
    """Whether custom normals or sharp edges let the faces around a vertex have other normals there."""
    if mesh.has_custom_normals:
        return True
    sharp = mesh.attributes.get("sharp_edge")
    if sharp is None or not len(sharp.data):
        return False
    values = np.empty(len(sharp.data), dtype=np.bool_)
    sharp.data.foreach_get("value", values)
    return bool(values.any())


def flat_normals(places: NDArray[np.float32]) -> NDArray[np.float32]:
    """The normal of each triangle at its three corners; zero where it has no area."""
    sides = places[:, 1:].astype(np.float64) - places[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    return np.repeat(normals[:, None, :], 3, axis=1).astype(np.float32)
