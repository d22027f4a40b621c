# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a mesh is closed, looks outwards, and what it has inside. Knows nothing of bpy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..files.ply_file import TriangleMesh

MOST_AT_ONCE = 1 << 22  # pairs of a point and a triangle; some 400 MB of float64


def is_closed(mesh: TriangleMesh) -> bool:
    """Whether two triangles meet at every edge; corners in one place count as one."""
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    corners = np.sort(place.reshape(-1)[mesh.triangles][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    corners = corners[corners[:, 0] != corners[:, 1]]  # of triangles without area
    return bool((np.unique(corners, axis=0, return_counts=True)[1] == 2).all())


def winding_numbers(mesh: TriangleMesh, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How often a closed `mesh` winds around each of `points` (n, 3): 0 outside, 1 inside, -1 where faces look inwards.

    The signed solid angles of all triangles over 4 pi (Van Oosterom and Strackee 1983).
    """
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    found = np.zeros(len(points))
    near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    for some in np.array_split(near, max(1, len(near) * len(corners) // MOST_AT_ONCE)):
        a, b, c = np.moveaxis(corners[None] - points[some, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(edge, axis=-1) for edge in (a, b, c))
        volume = np.einsum("...i,...i", a, np.cross(b, c))
        dots = (np.einsum("...i,...i", p, q) * length for p, q, length in ((a, b, lc), (b, c, la), (c, a, lb)))
        found[some] = 2.0 * np.arctan2(volume, la * lb * lc + sum(dots)).sum(axis=1) / (4.0 * np.pi)
    return found


def looks_outwards(mesh: TriangleMesh) -> bool:
    """Whether a closed mesh has a positive volume, each triangle being the base of a pyramid to one point."""
    a, b, c = np.moveaxis((mesh.positions[mesh.triangles] - mesh.positions[0]).astype(np.float64), 1, 0)
    return bool(np.einsum("ni,ni", a, np.cross(b, c)) > 0.0)
