# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of objects in the same place, of which a ray meets either. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..files.ply_file import TriangleMesh

GRID_STEPS = 1 << 16  # across the whole scene; triangles that agree to one of these are looked at
# Of the distance from the camera: planes so far apart are one to a ray. Measured with bpy 5.0.1 on two squares, along
# the axes and turned: the hidden one shows in 50 to 73 % of the pixels at 0, in 4 to 32 % at 1e-7, in at most 0.3 %
# at 3e-7 and in none at 1e-6. Larger: faces are named that do not show. Smaller: such are not named that do.
COPLANAR = 3e-7
# Sine of the angle between two faces that cross and are in no one place, as floor and wall: beside the line where they
# meet, what is nearer than `COPLANAR` of 10 m to both is 0.3 mm wide then
CROSSING = 0.01
# Of a triangle: a point so near to an edge may lie in both that meet there, by what floats leave. No measurement
BESIDE_EDGES = 1e-4
CLOSE = 1e-3  # of a triangle's longest side: corners so near are the same where the planes are


def shared_faces(places: Sequence[tuple[str, TriangleMesh]]) -> list[tuple[str, str]]:
    """Return the pairs of names that share a triangle, each once; a name with itself where it has one twice."""
    if not places:
        return []
    low = np.min([mesh.positions.min(axis=0) for _, mesh in places], axis=0).astype(np.float64)
    high = np.max([mesh.positions.max(axis=0) for _, mesh in places], axis=0).astype(np.float64)
    size = max(float((high - low).max()), 1e-12)
    keys = np.concatenate([_keys((mesh.positions - low) / size, mesh.triangles) for _, mesh in places])
    chosen = _repeated(keys)
    order = chosen[np.argsort(keys[chosen], kind="stable")]
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    first, second = order[same], order[same + 1]
    ends = np.cumsum([len(mesh.triangles) for _, mesh in places])
    close = _in_place(_corners(places, ends, first), _corners(places, ends, second), COPLANAR * size)
    owners = [np.searchsorted(ends, each[close], side="right") for each in (first, second)]
    pairs = np.unique(np.stack(owners, axis=1), axis=0)
    return list(dict.fromkeys((places[a][0], places[b][0]) for a, b in pairs))


def most_parallel(planes: Sequence[NDArray[np.float64]], others: Sequence[NDArray[np.float64]]) -> int:
    """How many of the `others` at one of some points lie in the plane of one that is there; each normals (k, 3)."""
    counts = [
        np.linalg.norm(np.cross(own[:, None], other[None]), axis=2) for own, other in zip(planes, others, strict=True)
    ]
    return max((int(np.count_nonzero((sines < CROSSING).any(axis=0))) for sines in counts), default=0)


def normals_around(
    points: NDArray[np.float64], reach: NDArray[np.float64], mesh: TriangleMesh
) -> list[NDArray[np.float64]]:
    """The normals (k, 3) of the triangles of a mesh that each of some points (n, 3) lies in, nearer than its reach."""
    found = [np.empty((0, 3))] * len(points)
    margin, least, most = reach[:, None], mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    # of thousands of small meshes, as a donut's sprinkles, each is at few of the points
    inside = np.flatnonzero(((points + margin >= least) & (points - margin <= most)).all(axis=1))
    if not len(inside):
        return found
    low, high = (points - margin)[inside].min(axis=0), (points + margin)[inside].max(axis=0)
    near = mesh.triangles
    for axis in range(3):  # one after the other: of a million triangles that takes a tenth of the time
        values = mesh.positions[:, axis][near]
        near = near[(values.min(axis=1) <= high[axis]) & (values.max(axis=1) >= low[axis])]
    corners = mesh.positions[near]
    lowest, highest = (np.ascontiguousarray(ends.T) for ends in (corners.min(axis=1), corners.max(axis=1)))
    for number in inside.tolist():
        point, own = points[number], float(reach[number])
        around = np.flatnonzero((lowest[0] <= point[0] + own) & (highest[0] >= point[0] - own))
        for axis in (1, 2):
            at, to = lowest[axis][around], highest[axis][around]
            around = around[(at <= point[axis] + own) & (to >= point[axis] - own)]
        if len(around):
            found[number] = _normals_around(corners[around].astype(np.float64), point, own)
    return found


def _normals_around(corners: NDArray[np.float64], point: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
    """The normals (k, 3) of those of some triangles (n, 3, 3) that hold a point."""
    first, second, third = (corners[:, k] for k in range(3))
    normal = np.cross(second - first, third - first)
    area = np.linalg.norm(normal, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        normal /= area[:, None]
    sides = [
        np.einsum("ij,ij->i", np.cross(b - a, point - a), normal)
        for a, b in ((first, second), (second, third), (third, first))
    ]
    apart = np.abs(np.einsum("ij,ij->i", point - first, normal))
    return normal[(np.min(sides, axis=0) > BESIDE_EDGES * area) & (apart <= reach)]


def _repeated(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where those are that are there more than once, in their order."""
    found = np.sort(keys)  # sorting alone takes a tenth of the time of sorting with the places
    repeated = np.unique(found[1:][found[1:] == found[:-1]])
    if not len(repeated):
        return np.empty(0, dtype=np.int64)
    at = np.minimum(np.searchsorted(repeated, keys), len(repeated) - 1)
    return np.flatnonzero(repeated[at] == keys)


def _corners(
    places: Sequence[tuple[str, TriangleMesh]], ends: NDArray[np.int64], triangles: NDArray[np.int64]
) -> NDArray[np.float64]:
    """The corners (n, 3, 3) of triangles that are counted over all meshes; `ends` are where the next mesh begins."""
    found = np.empty((len(triangles), 3, 3))
    owner = np.searchsorted(ends, triangles, side="right")
    for number in np.unique(owner):
        mesh, is_its = places[number][1], owner == number
        own = triangles[is_its] - (ends[number] - len(mesh.triangles))
        found[is_its] = mesh.positions[mesh.triangles[own]]
    return found


def _in_place(first: NDArray[np.float64], second: NDArray[np.float64], gap: float) -> NDArray[np.bool_]:
    """Whether triangles (n, 3, 3) with an area have the same corners in any order, and planes no further than a gap."""
    sides = np.linalg.norm(first - np.roll(first, 1, axis=1), axis=2)
    normal = np.cross(first[:, 1] - first[:, 0], first[:, 2] - first[:, 0])
    area = np.linalg.norm(normal, axis=1)
    above = np.abs(np.einsum("ijk,ik->ij", second - first[:, :1], normal)).max(axis=1)
    apart = np.linalg.norm(first[:, :, None] - second[:, None], axis=3).min(axis=2).max(axis=1)
    longest = sides.max(axis=1)
    return (apart <= CLOSE * longest) & (above <= gap * area) & (area > CLOSE * longest**2)


def _keys(points: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.int64]:
    """One number for each triangle of points in the unit cube, whichever corner comes first; others may share it."""
    grid = np.round(points * GRID_STEPS).astype(np.int64)
    mixed = (grid[:, 0] * 73856093) ^ (grid[:, 1] * 19349663) ^ (grid[:, 2] * 83492791)
    a, b, c = (mixed[corner] for corner in triangles.T)
    return (a + b + c) * 6364136223846793005 + a * b * c
