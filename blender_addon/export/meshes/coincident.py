# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of two objects in the same place, of which a ray meets either. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..files.ply_file import TriangleMesh

STEPS = 1 << 16  # across the whole scene; triangles are in the same place if they agree to one of these


def shared_faces(places: Sequence[tuple[str, TriangleMesh]]) -> list[tuple[str, str]]:
    """Return the pairs of different names that share a triangle, each once, in order of their first triangle."""
    if len({name for name, _ in places}) < 2:
        return []
    corners = [mesh.positions[mesh.triangles].astype(np.float64) for _, mesh in places]
    low = np.min([c.min(axis=(0, 1)) for c in corners], axis=0)
    high = np.max([c.max(axis=(0, 1)) for c in corners], axis=0)
    size = max(float((high - low).max()), 1e-12)
    owner = np.repeat(np.arange(len(corners)), [len(c) for c in corners])
    keys = np.concatenate([_keys((c - low) / size) for c in corners])
    order = np.argsort(keys, kind="stable")
    keys, owner = keys[order], owner[order]
    same = (keys[1:] == keys[:-1]) & (owner[1:] != owner[:-1])
    pairs = np.unique(np.stack([owner[:-1][same], owner[1:][same]], axis=1), axis=0)
    named = dict.fromkeys((places[a][0], places[b][0]) for a, b in pairs if places[a][0] != places[b][0])
    return list(named)


def _keys(corners: NDArray[np.float64]) -> NDArray[np.int64]:
    """One number for each triangle (n, 3, 3) in the unit cube, whichever corner comes first; triangles may share it."""
    grid = np.round(corners * STEPS).astype(np.int64)
    mixed = (grid[..., 0] * 73856093) ^ (grid[..., 1] * 19349663) ^ (grid[..., 2] * 83492791)
    total = mixed[:, 0] + mixed[:, 1] + mixed[:, 2]
    return total * 6364136223846793005 + mixed[:, 0] * mixed[:, 1] * mixed[:, 2]
