# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of what the camera sees of a mesh has normals that turn far from its faces. Knows nothing of bpy."""

from __future__ import annotations

import numpy as np

from ..camera.camera_model import Camera
from ..files.ply_file import TriangleMesh

# Cycles bends a normal where the mirrored view would be lower than this cosine above the face, or 0.9 of the view's
LOWEST = 0.01
MOST_TRIANGLES = 50_000  # that are looked at, evenly through the mesh: 20 ms


def share_of_bent_normals(mesh: TriangleMesh, camera: Camera) -> float:
    """Return the share of the visible area, in [0, 1], whose mirrored view points into its face.

    Obstacles are not looked at.
    """
    triangles = mesh.triangles[:: max(1, len(mesh.triangles) // MOST_TRIANGLES)]
    corners = mesh.positions[triangles].astype(np.float64)
    normals = mesh.normals[triangles].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    facet = across / np.maximum(area, 1e-30)[:, None]
    if camera.kind == "ORTHO":
        view = np.broadcast_to(camera.world[:3, 2], corners.shape)
        distance = np.ones(len(corners))
    else:
        view = camera.world[:3, 3] - corners
        distance = np.linalg.norm(view, axis=2).mean(axis=1)
        view = view / np.maximum(np.linalg.norm(view, axis=2, keepdims=True), 1e-30)
    height = np.einsum("tj,tcj->tc", facet, view)
    side = np.sign(height)
    along = np.einsum("tcj,tcj->tc", normals, view)
    mirrored = 2.0 * along * np.einsum("tj,tcj->tc", facet, normals) - height
    below = side * mirrored < np.minimum(0.9 * np.abs(height), LOWEST)
    seen = area * np.abs(height.mean(axis=1)) / np.maximum(distance, 1e-12) ** 2
    # the far side of a closed mesh counts as much as the near one, and is as bent
    return float(seen @ below.mean(axis=1)) / max(float(seen.sum()), 1e-30)
