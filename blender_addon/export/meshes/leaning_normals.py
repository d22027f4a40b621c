# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the normals of a mesh lean so far from its faces that two of them are told apart. Knows nothing of bpy."""

from __future__ import annotations

import numpy as np

from ..files.ply_file import TriangleMesh

# of light; with one normal a tenth of it was the most that a picture was off: a cube, 0.67, 3 to 6 %, a ball of 8
# segments, 0.23, 0.6 %, one of 32, 0.016, nothing above the noise of 0.1 %
LEAST_LEANING = 0.02
MOST_TRIANGLES = 50_000  # that are looked at, evenly through the mesh: 10 ms


def share_of_mirrored(mesh: TriangleMesh) -> float:
    """Return the share of light from all sides, in [0, 1], that a mirror along the normals sends into its own face.

    A normal leans by an angle d from its face: of directions that are met with the cosine a mirror sends those of a
    lune below the face, which are sin(d)^2 of all.
    """
    triangles = mesh.triangles[:: max(1, len(mesh.triangles) // MOST_TRIANGLES)]
    corners = mesh.positions[triangles].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    facet = across / np.maximum(area, 1e-30)[:, None]
    cosine = np.einsum("tj,tcj->tc", facet, mesh.normals[triangles].astype(np.float64))
    sent = np.clip(1.0 - cosine**2, 0.0, 1.0).mean(axis=1)
    return float(sent @ area) / max(float(area.sum()), 1e-30)


def normals_lean(mesh: TriangleMesh) -> bool:
    """Return whether diffuse light differs that is looked at along the mesh's normals and along those bent to views."""
    return share_of_mirrored(mesh) > LEAST_LEANING
