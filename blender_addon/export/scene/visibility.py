# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the camera sees the target at all, and what else it sees."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import bpy
import numpy as np
from mathutils import Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..camera.camera_model import Camera
from ..findings import Findings, Fix
from ..fitted_slot import FittedSlot
from ..lights.shadowless_lamps import note_hidden_lamps
from ..meshes.mesh_arrays import Piece
from ..nodes.clear_objects import bends_light, nodes_of, passes_light
from ..render_state import instanced_objects, rendered_objects
from .scene_data import SceneData

# rays towards as many points of the target are tried before it counts as hidden
PROBES = 2000
MET = 1e-4  # of a ray's length: it has met a point that it was aimed at; Blender's rays are single precision
MOST_SEEN = 200  # points of the target, of those that a ray meets, are looked for
RAYS = 12  # along each side of the frame, where it is looked for what lies in one plane
# Of a ray's length, some ten steps of a float: what it meets next lies further behind. With `MET` rays began within a
# box of which a decal lay 0.05 mm above, and met the floor that it stands on
BEHIND = 1e-6
MOST_BEHIND = 8  # surfaces on such a ray: two walls of a bottle, a drink in it, and what it stands on
# Rays from where each of those ends, for what lights it: walls that overlapped behind the camera are black in Cycles,
# and a room was 3.6 % too bright. Fewer: not tried
ONWARD = 4
OUTSIDE = "The camera does not see '{obj}': move it into the frame."
MIX = "ShaderNodeMixShader"  # whose other side may let light straight on


def look_at_targets(
    data: SceneData,
    fitted: Sequence[FittedSlot],
    pieces: Sequence[Sequence[Piece]],
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    findings: Findings,
    *,
    may_miss: bool,
) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Points (n, 3) of each target that the camera sees before all else, with its object's name.

    Which targets it does not see, an error unless it `may_miss` some, and which through what bends light is put into
    `data`.
    """
    for number, (each, own) in enumerate(zip(fitted, pieces, strict=True)):
        of_one = Findings()
        seen, data.behind[number] = check_visible(data, own, each.object, each.slot, scene, depsgraph, of_one)
        note_hidden_lamps(each.object, seen, data.lights, data.origin, scene, depsgraph, findings)
        if of_one.errors:
            data.unseen[number] = of_one.errors[0]
            if not may_miss:
                findings.error(of_one.errors[0], *of_one.fixes[of_one.errors[0]])
        yield each.object.name, seen


def check_visible(
    data: SceneData,
    pieces: Sequence[Piece],
    target: bpy.types.Object,
    slot: int,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    findings: Findings,
) -> tuple[NDArray[np.float64], str]:
    """Report an error if none of the target's `pieces` lies in the frame, or everything in the frame is hidden.

    Returns points (n, 3) of the target that a ray from the camera meets before all else, at most `MOST_SEEN`, and the
    name of what bends all views of it, "" where one is straight.
    """
    camera = data.camera
    seen: list[NDArray[np.float64]] = []
    inside = np.concatenate(list(_points_inside(pieces, camera)))
    if not len(inside):
        every = np.concatenate([part.reshape(-1, 3) for piece in pieces for part in piece.corners()])
        corners, corner_depths = camera.project(every)
        behind = (corner_depths < camera.clip_start).all() or (corner_depths > camera.clip_end).all()
        if behind or camera.beside(corners):
            findings.error(OUTSIDE.format(obj=target.name), *_whole_frame(camera))
        return np.empty((0, 3)), ""
    probed = inside[np.linspace(0, len(inside) - 1, min(len(inside), PROBES)).astype(int)]
    probed = np.random.default_rng(0).permutation(probed)  # the first few are of all faces
    is_seen, is_plain, blocker, glass = False, False, "", ""
    for number, point in enumerate(probed):
        hit, face, gap = _first_hit(point, data, scene, depsgraph)
        if gap <= MET:
            seen.append(point)
        if hit is None or (hit.original == target and _is_of_slot(hit, face, slot)) or _lets_light_through(hit):
            is_seen = True
            if hit is None or hit.original == target or not _bends_all_light(hit):
                is_plain = True
            else:
                glass = hit.name
        else:
            blocker = hit.name
        if is_plain and (number >= MOST_SEEN or len(seen) == MOST_SEEN):
            break
    if not is_seen:
        findings.error(f"The camera does not see '{target.name}': it is hidden behind '{blocker}'.")
    return np.array(seen).reshape(-1, 3), "" if is_plain else glass


def say_no_faces(fitted: FittedSlot, view_layer: bpy.types.ViewLayer, left_out: int, findings: Findings) -> None:
    """Report why an object has no faces to fit, of which `left_out` triangles are nowhere."""
    name = fitted.object.name
    if fitted.object.name_full not in rendered_objects(view_layer) | instanced_objects(view_layer):
        findings.error(f"Object '{name}' is hidden in the render: show it.", Fix("show_in_render"))
    elif _is_put_away(fitted.object):
        findings.error(
            f"Object '{name}' shows others and not itself in the render: turn its Show Emitter (of particles) or Show "
            "Instancer (Render) on."
        )
    elif left_out:
        findings.error(
            f"All faces of '{name}' with its active material have corners at NaN, infinite or absurdly "
            "far positions (1e18 m): move or scale the object, or mend its mesh."
        )
    elif fitted.slot == fitted.object.active_material_index:
        findings.error(f"No face of '{name}' uses its active material slot {fitted.slot + 1}: choose another.")
    else:
        findings.error(f"No face of '{name}' uses its material slot {fitted.slot + 1}: choose another.")


def met_points(
    data: SceneData, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph
) -> dict[str, NDArray[np.float64]]:
    """Points (n, 3) where rays all over the frame meet each object, by its name, also those behind what is clear, and
    where light comes from to their ends."""
    corners = np.array([scene.camera.matrix_world @ corner for corner in scene.camera.data.view_frame(scene=scene)])
    world, found = data.camera.world, dict[str, list[NDArray[np.float64]]]()
    forward, eye = -world[:3, 2], data.origin + world[:3, 3]
    steps, random = (np.arange(RAYS) + 0.5) / RAYS, np.random.default_rng(0)
    for along, down in product(steps, steps):
        place = corners[0] + (corners[1] - corners[0]) * down + (corners[3] - corners[0]) * along
        is_flat = data.camera.kind == "ORTHO"
        direction = forward if is_flat else place - eye
        start = place - forward * (forward @ (place - eye)) if is_flat else eye
        start = start + direction * (data.camera.clip_start / float(direction @ forward))
        begin = start
        for _ in range(MOST_BEHIND):
            hit, at, normal, _, item, _ = scene.ray_cast(depsgraph, Vector(start), Vector(direction))
            if not hit:
                break
            found.setdefault(item.name, []).append(np.array(at) - data.origin)
            if not _lets_light_through(item):
                outward = np.array(normal, np.float64)
                side = -outward * np.sign(outward @ direction)
                away = BEHIND * float(np.linalg.norm(np.array(at) - begin))
                for name, there in _met_from(scene, depsgraph, np.array(at) + away * side, side, random):
                    found.setdefault(name, []).append(there - data.origin)
                break
            start = begin + (1.0 + BEHIND) * (np.array(at) - begin)
    return {name: np.array(points) for name, points in found.items()}


def _met_from(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    start: NDArray[np.float64],
    normal: NDArray[np.float64],
    random: np.random.Generator,
) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """What `ONWARD` rays by the cosine about a normal meet, by its name, and where."""
    for sent in random.normal(size=(ONWARD, 3)):
        direction = sent + np.linalg.norm(sent) * normal
        hit, at, _, _, item, _ = scene.ray_cast(depsgraph, Vector(start), Vector(direction))
        if hit:
            yield item.name, np.array(at)


def _is_put_away(item: bpy.types.Object) -> bool:
    """Whether an instancer, or an emitter of particles, is not rendered itself."""
    return not item.show_instancer_for_render and (bool(item.particle_systems) or item.instance_type != "NONE")


def _whole_frame(camera: Camera) -> list[Fix]:
    return [] if camera.region is None else [Fix("whole_frame")]


def _is_of_slot(item: bpy.types.Object, face: int, slot: int) -> bool:
    """Whether a face of the target may have the fitted material; an object may hide some of its own faces."""
    if item.type != "MESH" or face >= len(item.data.polygons):
        return True
    last = max(len(item.material_slots) - 1, 0)
    return min(item.data.polygons[face].material_index, last) == slot


def _points_inside(pieces: Sequence[Piece], camera: Camera) -> Iterator[NDArray[np.float64]]:
    """Points (n, 3) on the triangles that lie in the frame: the middles, and more of each the fewer there are."""
    steps = [(1 / 3, 1 / 3)]
    total = sum(map(len, pieces))
    if total < PROBES:
        count = int(np.ceil(np.sqrt(2 * PROBES / total)))
        grid = (np.arange(count) + 0.5) / count
        steps += [(a, b) for a in grid for b in grid if a + b < 1.0]
    a, b = np.array(steps).T[:, None, :, None]
    for corners in (part for piece in pieces for part in piece.corners()):
        first, second, third = corners[:, 0, None], corners[:, 1, None], corners[:, 2, None]
        points = (first + (second - first) * a + (third - first) * b).reshape(-1, 3)
        places, depths = camera.project(points)
        yield points[camera.shown(places) & (depths > camera.clip_start) & (depths < camera.clip_end)]


def _first_hit(
    point: NDArray[np.float64], data: SceneData, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph
) -> tuple[bpy.types.Object | None, int, float]:
    """What a ray from the camera towards a point meets first, which face of it, and how far from the point.

    That is a share of the distance from where the ray begins.
    """
    world = data.camera.world
    forward = -world[:3, 2]
    if data.camera.kind == "ORTHO":
        origin, direction = point - forward * (forward @ (point - world[:3, 3])), forward
    else:
        origin, direction = world[:3, 3], point - world[:3, 3]
    start = data.origin + origin + direction * (data.camera.clip_start / float(direction @ forward))
    hit, place, _, face, item, _ = scene.ray_cast(depsgraph, Vector(start), Vector(direction))
    if not hit:
        return None, face, np.inf
    there = data.origin + point
    return item, face, float(np.linalg.norm(np.array(place) - there) / max(np.linalg.norm(there - start), 1e-30))


def _bends_all_light(item: bpy.types.Object) -> bool:
    """Whether what is seen through `item` is seen through glass: nothing lets light straight on."""
    if item.hide_render or not item.visible_camera or passes_light(item):
        return False
    return bends_light(item) and not any(node.bl_idname == MIX for node in nodes_of(item))


def _lets_light_through(item: bpy.types.Object) -> bool:
    """Whether something behind `item` may still be seen: its material transmits, or the render does not show it."""
    return item.hide_render or not item.visible_camera or bends_light(item) or passes_light(item)
