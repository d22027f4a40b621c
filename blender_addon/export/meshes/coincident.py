# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of objects in the same place, of which a ray meets either. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..files.ply_file import TriangleMesh

STEPS = 1 << 16  # across the whole scene; triangles that agree to one of these are looked at
CLOSE = 1e-3  # of a triangle's longest side: corners so near are in the same place


def shared_faces(places: Sequence[tuple[str, TriangleMesh]]) -> list[tuple[str, str]]:
    """Return the pairs of names that share a triangle, each once; a name with itself where it has one twice."""
    if not places:
        return []
    corners = [mesh.positions[mesh.triangles].astype(np.float64) for _, mesh in places]
    low = np.min([c.min(axis=(0, 1)) for c in corners], axis=0)
    high = np.max([c.max(axis=(0, 1)) for c in corners], axis=0)
    size = max(float((high - low).max()), 1e-12)
    owner = np.repeat(np.arange(len(corners)), [len(c) for c in corners])
    keys = np.concatenate([_keys((c - low) / size) for c in corners])
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    first, second = order[same], order[same + 1]
    every = np.concatenate(corners)
    close = _in_place(every[first], every[second])
    pairs = np.unique(np.stack([owner[first[close]], owner[second[close]]], axis=1), axis=0)
    return list(dict.fromkeys((places[a][0], places[b][0]) for a, b in pairs))


def _in_place(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether triangles (n, 3, 3) with an area have the same corners in any order."""
    sides = np.linalg.norm(first - np.roll(first, 1, axis=1), axis=2)
    area = np.linalg.norm(np.cross(first[:, 1] - first[:, 0], first[:, 2] - first[:, 0]), axis=1)
    apart = np.linalg.norm(first[:, :, None] - second[:, None], axis=3).min(axis=2).max(axis=1)
    longest = sides.max(axis=1)
    return (apart <= CLOSE * longest) & (area > CLOSE * longest**2)


def _keys(corners: NDArray[np.float64]) -> NDArray[np.int64]:
    """One number for each triangle (n, 3, 3) in the unit cube, whichever corner comes first; triangles may share it."""
    grid = np.round(corners * STEPS).astype(np.int64)
    mixed = (grid[..., 0] * 73856093) ^ (grid[..., 1] * 19349663) ^ (grid[..., 2] * 83492791)
    total = mixed[:, 0] + mixed[:, 1] + mixed[:, 2]
    return total * 6364136223846793005 + mixed[:, 0] * mixed[:, 1] * mixed[:, 2]
