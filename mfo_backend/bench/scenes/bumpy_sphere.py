# SPDX-License-Identifier: Apache-2.0
"""A closed object with hills and hollows for machines without a folder of meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_RINGS, _SEGMENTS = 64, 128


def bumpy_sphere(seed: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices (count, 3) and triangles (count, 3), outward, of a sphere with random smooth bumps, radius at most 1."""
    rng = np.random.default_rng(seed)
    polar = np.linspace(0.0, np.pi, _RINGS + 1)[1:-1]
    azimuth = np.arange(_SEGMENTS) * (2.0 * np.pi / _SEGMENTS)
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.sin(azimuth)),
            np.outer(np.cos(polar), np.ones_like(azimuth)),
            np.outer(np.sin(polar), np.cos(azimuth)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    direction = np.concatenate([[[0.0, 1.0, 0.0]], ring, [[0.0, -1.0, 0.0]]])
    waves = rng.normal(size=(8, 3)) * 3.0  # about half to one and a half waves over the diameter
    radius = 1.0 + 0.08 * np.sin(direction @ waves.T + rng.uniform(0.0, 2.0 * np.pi, 8)).sum(axis=1)
    vertices = direction * (radius / radius.max())[:, None]
    return vertices.astype(np.float32), _triangles()


def _triangles() -> NDArray[np.int32]:
    """Two fans around the poles and two triangles for every patch between."""
    rows = _RINGS - 1
    index = 1 + np.arange(rows * _SEGMENTS).reshape(rows, _SEGMENTS)
    after = np.roll(index, -1, axis=1)
    top, bottom = np.zeros(_SEGMENTS, int), np.full(_SEGMENTS, 1 + rows * _SEGMENTS)
    parts = [
        np.stack([top, index[0], after[0]], axis=-1),
        np.stack([index[:-1], index[1:], after[1:]], axis=-1).reshape(-1, 3),
        np.stack([index[:-1], after[1:], after[:-1]], axis=-1).reshape(-1, 3),
        np.stack([bottom, after[-1], index[-1]], axis=-1),
    ]
    return np.concatenate(parts).astype(np.int32)


def write_ply(path: Path, vertices: NDArray[np.float32], triangles: NDArray[np.int32]) -> None:
    """A binary PLY with smooth normals, each the sum of its triangles' area-weighted ones."""
    corners = vertices[triangles].astype(np.float64)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros(vertices.shape)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], facing)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{names}"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, triangles
    body = np.concatenate([vertices, normals], axis=1).astype("<f4")
    path.write_bytes(header.encode("ascii") + body.tobytes() + faces.tobytes())
