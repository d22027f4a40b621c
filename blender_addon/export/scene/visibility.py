# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the camera sees the target at all."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..camera.camera_model import Camera
from ..findings import Findings, Fix
from .scene_data import SceneData, Shape

# rays towards as many points of the target are tried before it counts as hidden
PROBES = 2000
OUTSIDE = "The camera does not see '{obj}': move it into the frame."


def check_visible(
    data: SceneData,
    shape: Shape,
    target: bpy.types.Object,
    slot: int,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    findings: Findings,
) -> None:
    """Report an error if no part of the target's `shape` lies in the frame, or everything in the frame is hidden."""
    points = _points(shape.mesh.positions.astype(np.float64)[shape.mesh.triangles])
    camera = data.camera
    places, depths = camera.project(points)
    inside = camera.shown(places)
    inside &= (depths > camera.clip_start) & (depths < camera.clip_end)
    if not inside.any():
        corners, corner_depths = camera.project(shape.mesh.positions.astype(np.float64))
        behind = (corner_depths < camera.clip_start).all() or (corner_depths > camera.clip_end).all()
        if behind or camera.beside(corners):
            findings.error(OUTSIDE.format(obj=target.name), *_whole_frame(camera))
        return
    seen = points[inside]
    seen = seen[np.linspace(0, len(seen) - 1, min(len(seen), PROBES)).astype(int)]
    blocker = ""
    for point in seen:
        hit, face = _first_hit(point, data, scene, depsgraph)
        if hit is None or (hit.original == target and _is_of_slot(hit, face, slot)):
            return
        blocker = hit.name
        if _lets_light_through(hit):
            return
    findings.error(f"The camera does not see '{target.name}': it is hidden behind '{blocker}'.")


def _whole_frame(camera: Camera) -> list[Fix]:
    return [] if camera.region is None else [Fix("whole_frame")]


def _is_of_slot(item: bpy.types.Object, face: int, slot: int) -> bool:
    """Whether a face of the target may have the fitted material; an object may hide some of its own faces."""
    if item.type != "MESH" or face >= len(item.data.polygons):
        return True
    last = max(len(item.material_slots) - 1, 0)
    return min(item.data.polygons[face].material_index, last) == slot


def _points(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points on triangles (n, 3, 3): the middles, and more of each the fewer there are."""
    steps = [(1 / 3, 1 / 3)]
    if len(triangles) < PROBES:
        count = int(np.ceil(np.sqrt(2 * PROBES / len(triangles))))
        grid = (np.arange(count) + 0.5) / count
        steps += [(a, b) for a in grid for b in grid if a + b < 1.0]
    a, b = np.array(steps).T[:, None, :, None]
    first, second, third = triangles[:, 0, None], triangles[:, 1, None], triangles[:, 2, None]
    return (first + (second - first) * a + (third - first) * b).reshape(-1, 3)


def _first_hit(
    point: NDArray[np.float64], data: SceneData, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph
) -> tuple[bpy.types.Object | None, int]:
    """What a ray from the camera towards a point meets first, and which face of it."""
    world = data.camera.world
    forward = -world[:3, 2]
    if data.camera.kind == "ORTHO":
        origin, direction = point - forward * (forward @ (point - world[:3, 3])), forward
    else:
        origin, direction = world[:3, 3], point - world[:3, 3]
    start = data.origin + origin + direction * (data.camera.clip_start / float(direction @ forward))
    hit, _, _, face, item, _ = scene.ray_cast(depsgraph, Vector(start), Vector(direction))
    return (item if hit else None), face


def _lets_light_through(item: bpy.types.Object) -> bool:
    """Whether something behind `item` may still be seen: its material transmits, or the render does not show it."""
    if item.hide_render or not item.visible_camera:
        return True
    for slot in item.material_slots:
        for node in slot.material.node_tree.nodes if slot.material and slot.material.node_tree else []:
            if node.bl_idname in ("ShaderNodeBsdfTransparent", "ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction"):
                return True
            for name, opaque in (("Transmission Weight", 0.0), ("Alpha", 1.0)):
                socket = node.inputs.get(name)
                if socket is not None and (socket.is_linked or socket.default_value != opaque):
                    return True
    return False
