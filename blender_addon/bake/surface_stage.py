# SPDX-License-Identifier: GPL-3.0-or-later
"""The object that a surface is baked on: alone, with a UV map of its own and the map's directions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Matrix  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..export.meshes.read_mesh import corners_of, material_of_slot, slot_count
from ..export.nodes.displacement import moves_faces
from .displaced import Moved, moved_corners
from .stage import Stage, staged
from .unwrap import unwrapped

UV_MAP, NO_MAP = "material_fit", "material_fit_none"
TANGENT, NORMAL = "material_fit_tangent", "material_fit_normal"  # attributes
BLEED = 8  # texels around islands that take the colour beside them
SAMPLES = 4  # a texel, so that fine patterns are averaged
MOST_UV_MAPS = 8  # of a mesh


class SurfaceStage(NamedTuple):
    """The object to bake, with a UV map and a material of its own."""

    stage: Stage
    corners: NDArray[np.float32]

    @property
    def scene(self) -> bpy.types.Scene:
        """The scene that it is alone in."""
        return self.stage.scene

    @property
    def item(self) -> bpy.types.Object:
        """The object."""
        return self.stage.item


@contextmanager
def surface_stage(
    scene: bpy.types.Scene,
    instance: Any,
    depsgraph: bpy.types.Depsgraph,
    slot: int,
    material: bpy.types.Material,
    size: int,
    *,
    for_normals: bool,
) -> Iterator[SurfaceStage]:
    """The object of an instance alone, with a UV map for the faces in `slot`, which have `material`.

    What is `for_normals` has the frames of faces that a displacement has moved, which take Cycles a bake to know: the
    attribute `NORMAL` has their smooth normals, and zero on flat faces.
    """
    last = max(slot_count(instance.object) - 1, 0)
    slots = [material_of_slot(instance.object, number) for number in range(last + 1)]
    is_moved = for_normals and any(shown is not None and moves_faces(shown.original) for shown in slots)
    moved = moved_corners(scene, instance, depsgraph) if is_moved else None
    blank = bpy.data.materials.new("material_fit_blank")
    try:
        with staged(scene, instance, depsgraph) as stage:
            mesh: Any = stage.item.data
            stage.scene.cycles.samples = SAMPLES
            settings = stage.scene.render.bake
            settings.target, settings.margin, settings.margin_type = "IMAGE_TEXTURES", BLEED, "EXTEND"
            faces = np.empty(len(mesh.polygons), dtype=np.int32)
            mesh.polygons.foreach_get("material_index", faces)
            uv = unwrapped(mesh, np.clip(faces, 0, last) == slot, stage.scene, size)
            while len(mesh.uv_layers) >= MOST_UV_MAPS:
                mesh.uv_layers.remove(next(layer for layer in reversed(mesh.uv_layers) if not layer.active_render))
            if not len(mesh.uv_layers):  # without one nodes have zero for UV, and not the map of the bake
                mesh.uv_layers.new(name=NO_MAP, do_init=False).active_render = True
            layer = mesh.uv_layers.new(name=UV_MAP, do_init=False)
            layer.uv.foreach_set("vector", uv.reshape(-1))
            mesh.uv_layers.active = layer
            corners = _add_tangents(mesh, uv, instance.matrix_world, None if moved is None else moved.positions)
            if moved is not None:
                _add_normals(mesh, instance.matrix_world, moved)
            mesh.materials.clear()
            for number in range(last + 1):
                mesh.materials.append(material if number == slot else blank)
            mesh.polygons.foreach_set("material_index", np.clip(faces, 0, last))  # clear() has set them to 0
            yield SurfaceStage(stage, corners)
    finally:
        bpy.data.materials.remove(blank)


def _add_tangents(
    mesh: bpy.types.Mesh, uv: NDArray[np.float32], matrix: Matrix, moved: NDArray[np.float32] | None
) -> NDArray[np.float32]:
    """Give `mesh` dp/du of the map `uv` as an attribute in world space; returns uv by triangle (triangles, 3, 2).

    Where a displacement moves its triangles it is that of their corners where they have `moved`.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops, vertices = np.empty(count * 3, dtype=np.int32), np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loops.foreach_get("vertex_index", vertices)
    places = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    shown = places.reshape(-1, 3)[vertices[loops]].reshape(-1, 3, 3) if moved is None else moved
    linear = np.array(matrix.to_3x3(), dtype=np.float64)
    corners = uv[loops].reshape(-1, 3, 2)
    points = shown @ linear.T
    along, across = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    (u1, v1), (u2, v2) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    sign = np.sign(u1 * v2 - u2 * v1)[:, None]
    tangent = sign * (v2[:, None] * along - v1[:, None] * across)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-20)
    at_corner = np.zeros((len(mesh.loops), 3), dtype=np.float32)
    at_corner[loops] = np.repeat(tangent, 3, axis=0)
    attribute = mesh.attributes.new(TANGENT, "FLOAT_VECTOR", "CORNER")
    attribute.data.foreach_set("vector", at_corner.reshape(-1))
    return corners


def _add_normals(mesh: bpy.types.Mesh, matrix: Matrix, moved: Moved) -> None:
    """Give `mesh` the smooth normals of its corners as an attribute in world space, zero where faces are flat."""
    _, loops, _ = corners_of(mesh)
    normals = moved.normals @ np.linalg.pinv(np.array(matrix.to_3x3(), dtype=np.float64))
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-20)
    at_corner = np.zeros((len(mesh.loops), 3), dtype=np.float32)
    at_corner[loops] = np.where(moved.has_own[:, None, None], normals, 0.0).reshape(-1, 3)
    attribute = mesh.attributes.new(NORMAL, "FLOAT_VECTOR", "CORNER")
    attribute.data.foreach_set("vector", at_corner.reshape(-1))
