# SPDX-License-Identifier: GPL-3.0-or-later
"""From corners of Blender's faces to the shared vertices of Mitsuba's triangles. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..files.ply_file import TriangleMesh

BLOCK = 1 << 12  # triangles at a time, whose numbers a processor's cache holds
FARTHEST = 1e18  # metres; the square of a distance must fit into a float32
_FACTOR = np.uint64(0x9E3779B97F4A7C15)  # odd, near 2**64 over the golden ratio (Knuth, TAOCP 3, 6.4)


@dataclass(frozen=True, eq=False)
class CornerMesh:
    """One triangulated mesh in its own space: three corners a triangle and the material slot of each triangle.

    Corners of one vertex need not be the same: `vertices` says where to look for equal ones first. `tangents` circle an
    axis, see `circling_tangents`.
    """

    positions: NDArray[np.float32]  # (triangles, 3, 3)
    normals: NDArray[np.float32]  # (triangles, 3, 3)
    uvs: NDArray[np.float32]  # (triangles, 3, 2)
    slots: NDArray[np.int32]  # (triangles,)
    vertices: NDArray[np.int32]  # (triangles, 3), each at least 0
    tangents: NDArray[np.float32] | None = None  # (triangles, 3, 3)

    @property
    def is_open(self) -> bool:
        """Whether it has an edge of one triangle alone, past which its back can be seen."""
        ends = np.sort(self.vertices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
        _, triangles = np.unique(ends[:, 0] << 32 | ends[:, 1], return_counts=True)
        return bool((triangles == 1).any())


def same_mesh(first: CornerMesh, second: CornerMesh) -> bool:
    """Whether two meshes have equal numbers; those with NaN count as others."""
    return all(np.array_equal(getattr(first, each.name), getattr(second, each.name)) for each in fields(CornerMesh))


@dataclass(frozen=True, eq=False)
class Piece:
    """Some triangles of a mesh, moved into the world."""

    mesh: CornerMesh
    faces: NDArray[np.bool_]  # (triangles,)
    matrix: NDArray[np.float64]  # 4x4

    def __len__(self) -> int:
        return int(np.count_nonzero(self.faces))

    @property
    def stretch(self) -> float:
        """How many times as long equal lengths may become along one direction as along another."""
        sizes = np.linalg.svd(self.matrix[:3, :3], compute_uv=False)
        return float(sizes[0] / max(sizes[-1], 1e-30))

    def placed(self) -> TriangleMesh:
        """Its `world_mesh`."""
        return world_mesh(self.mesh, self.faces, self.matrix)

    def corners(self) -> Iterator[NDArray[np.float64]]:
        """Corners (n, 3, 3) in the world of the triangles that `placed` keeps, some at a time."""
        chosen = np.flatnonzero(self.faces)
        for start in range(0, len(chosen), BLOCK):
            places = self.mesh.positions[chosen[start : start + BLOCK]].astype(np.float64)
            with np.errstate(invalid="ignore", over="ignore"):
                places = places @ self.matrix[:3, :3].T + self.matrix[:3, 3]
                yield places[(np.abs(places) < FARTHEST).all(axis=(1, 2))]

    def may_hold(self, point: NDArray[np.float64]) -> bool:
        """Whether a point of the world is within its bounds, as that of a camera in a room."""
        ends = np.array([(corners.min(axis=(0, 1)), corners.max(axis=(0, 1))) for corners in self.corners()])
        return len(ends) > 0 and bool(((ends[:, 0].min(axis=0) <= point) & (point <= ends[:, 1].max(axis=0))).all())

    def left_out(self) -> int:
        """How many triangles `placed` leaves out."""
        ends = np.array([self.mesh.positions.min(axis=(0, 1)), self.mesh.positions.max(axis=(0, 1))], dtype=np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            reach = np.abs(ends).max(axis=0) @ np.abs(self.matrix[:3, :3]).T + np.abs(self.matrix[:3, 3])
            if (reach < FARTHEST).all():
                return 0
        return len(self) - sum(len(corners) for corners in self.corners())


def world_mesh(mesh: CornerMesh, slots: NDArray[np.bool_], matrix: NDArray[np.float64]) -> TriangleMesh:
    """Return the triangles selected by `slots` (triangles,) moved by the 4x4 `matrix`, equal corners shared.

    Triangles with a corner at NaN or farther than FARTHEST are left out. Normals, and tangents as in Cycles, move with
    the inverse transpose. A mirroring matrix turns the winding around, so that the side a normal points to stays the
    outside, as in Cycles.
    """
    # sharing comes first: the corners are six times as many as the vertices of a smooth mesh
    rows, index = _shared_corners(mesh, slots)
    linear = matrix[:3, :3]
    mirrored = bool(np.linalg.det(linear) < 0.0)
    # adjugate transpose instead of the inverse: it exists for flat matrices too
    cofactor = np.stack(
        [np.cross(linear[1], linear[2]), np.cross(linear[2], linear[0]), np.cross(linear[0], linear[1])]
    )
    if mirrored:
        cofactor = -cofactor
    with np.errstate(invalid="ignore", over="ignore"):
        positions = rows[:, :3].astype(np.float64) @ linear.T + matrix[:3, 3]
        held = (np.abs(positions) < FARTHEST).all(axis=1)  # False for NaN
        if not held.all():
            rows, index = _shared(rows[index[np.repeat(held[index].reshape(-1, 3).all(axis=1), 3)]])
            positions = rows[:, :3].astype(np.float64) @ linear.T + matrix[:3, 3]
        normals = rows[:, 3:6].astype(np.float64) @ cofactor.T
        lengths = np.linalg.norm(normals, axis=1)
    without = ~(lengths > 1e-20)  # True for NaN
    normals = np.where(without[:, None], 0.0, normals) / np.where(without, 1.0, lengths)[:, None]
    # Mitsuba counts the rows of a picture from the top, Blender's v from the bottom
    uvs = np.nan_to_num(rows[:, 6:8], posinf=0.0, neginf=0.0) * (1.0, -1.0) + (0.0, 1.0)
    tangents = [] if mesh.tangents is None else [_at_most_unit(rows[:, 8:].astype(np.float64) @ cofactor.T)]
    rows = np.concatenate([positions, normals, uvs, *tangents], axis=1).astype(np.float32)
    if without.any():  # such a corner takes the normal of its triangle
        rows, without = rows[index], without[index]
        rows[without, 3:6] = _face_normals(positions[index].reshape(-1, 3, 3), mirrored)[without]
        rows, index = _shared(rows)
    triangles = index.reshape(-1, 3).astype(np.int32)
    if mirrored:
        triangles = triangles[:, ::-1]
    return TriangleMesh(
        np.ascontiguousarray(rows[:, :3]),
        np.ascontiguousarray(rows[:, 3:6]),
        np.ascontiguousarray(rows[:, 6:8]),
        np.ascontiguousarray(triangles),
        None if mesh.tangents is None else np.ascontiguousarray(rows[:, 8:]),
    )


def _at_most_unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """All vectors (n, 3) by one factor, the longest at unit length; zero where they are not finite."""
    vectors = np.nan_to_num(vectors, posinf=0.0, neginf=0.0)
    return vectors / max(float(np.linalg.norm(vectors, axis=1).max(initial=0.0)), 1e-30)


def circling_tangents(
    positions: NDArray[np.float32], middle: NDArray[np.float64], size: NDArray[np.float64], axis: str
) -> NDArray[np.float32]:
    """The tangents (..., 3) by which Cycles turns highlights about an axis, X, Y or Z, of a mesh, in its space.

    They come from Generated coordinates: positions (..., 3) in a box about `middle`, of half its `size` on each side.
    Cycles moves them as normals and takes the part in the surface (`svm_node_tangent`, kernel/svm/tex_coord.h).
    """
    half = np.divide(0.5, size, out=np.zeros(3), where=size != 0.0)
    x, y, z = np.moveaxis((positions - middle) * half, -1, 0)
    nothing = np.zeros_like(x)
    found = {"X": (nothing, -z, y), "Y": (-z, nothing, x), "Z": (-y, x, nothing)}[axis]
    return np.stack(found, axis=-1).astype(np.float32)


def joined(meshes: Sequence[TriangleMesh]) -> TriangleMesh:
    """Return all triangles of `meshes` as one mesh."""
    if len(meshes) == 1:
        return meshes[0]
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes[:-1])])
    tangents = [mesh.tangents for mesh in meshes if mesh.tangents is not None]
    return TriangleMesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uvs for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]).astype(np.int32),
        np.concatenate(tangents) if len(tangents) == len(meshes) else None,
    )


def _shared_corners(mesh: CornerMesh, faces: NDArray[np.bool_]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """`_shared` of the corners of these faces as rows, of which those like another of their vertex are left out."""
    parts = [mesh.positions, mesh.normals, mesh.uvs, *([] if mesh.tangents is None else [mesh.tangents])]
    parts = [part if faces.all() else part[faces] for part in parts]
    parts = [part.reshape(-1, part.shape[-1]) for part in parts]
    vertices = mesh.vertices[faces].reshape(-1)
    own = np.arange(len(vertices))
    last = np.zeros(vertices.max(initial=0) + 1, dtype=np.int64)
    last[vertices] = own
    twin = last[vertices]
    is_like = np.all([(part == part[twin]).all(axis=1) for part in parts], axis=0)  # NaN is not, which is only slower
    twin = np.where(is_like, twin, own)
    kept = np.flatnonzero(twin == own)
    rows, index = _shared(np.concatenate([part[kept] for part in parts], axis=1))
    place = np.empty(len(own), dtype=np.int64)
    place[kept] = index
    return rows, place[twin]


def _shared(rows: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return the distinct rows of `rows` (n, 8 or 11) and the index of each row among them."""
    rows = rows + np.float32(0.0)  # -0.0 and 0.0 are one
    # sorting 64-bit hashes takes a tenth of the time of sorting rows; two numbers at a time are one of 64 bits
    pairs = (rows if rows.shape[1] % 2 == 0 else np.pad(rows, ((0, 0), (0, 1)))).view(np.uint64)
    hashes = np.zeros(len(rows), np.uint64)
    for column in range(pairs.shape[1]):
        hashes = (hashes ^ pairs[:, column]) * _FACTOR
        hashes ^= hashes >> np.uint64(32)
    _, first, index = np.unique(hashes, return_index=True, return_inverse=True)
    if (pairs[first][index] == pairs).all():  # as bits, since NaN is not equal to itself
        return rows[first], index
    _, first, index = np.unique(rows, axis=0, return_index=True, return_inverse=True)  # two rows had one hash
    return rows[first], index.reshape(-1)


def _face_normals(triangles: NDArray[np.float64], mirrored: bool) -> NDArray[np.float64]:
    """Return the geometric normal for each corner, (3 * triangles, 3); +Z for triangles without area."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    if mirrored:
        normals = -normals
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(lengths > 1e-30, normals / np.maximum(lengths, 1e-30), np.array([0.0, 0.0, 1.0]))
    return np.repeat(normals, 3, axis=0)
