# SPDX-License-Identifier: Apache-2.0
"""How far normals lean from their faces: by mirrored views that are drawn, and where two normals begin to matter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from blender_addon.export.files.ply_file import TriangleMesh
from blender_addon.export.meshes.leaning_normals import normals_lean, share_of_mirrored


def triangle(lean: float, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    corners = size * np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    return corners, np.tile([np.sin(lean), 0.0, np.cos(lean)], (3, 1))


def mesh_of(*triangles: tuple[np.ndarray, np.ndarray]) -> TriangleMesh:
    positions, normals = (np.concatenate(a).astype(np.float32) for a in zip(*triangles, strict=True))
    count = len(positions)
    faces = np.arange(count, dtype=np.int32).reshape(-1, 3)
    return TriangleMesh(positions, normals, np.zeros((count, 2), np.float32), faces)


@pytest.mark.parametrize("degrees", [0.0, 10.0, 40.0, 80.0])
def test_the_share_is_that_of_mirrored_views(degrees: float) -> None:
    draw = np.random.default_rng(1)
    u, turn = draw.random(400_000), draw.uniform(0.0, 2.0 * np.pi, 400_000)
    view = np.stack([np.sqrt(u) * np.cos(turn), np.sqrt(u) * np.sin(turn), np.sqrt(1.0 - u)], axis=1)
    corners, normals = triangle(np.radians(degrees))
    mirrored = 2.0 * (view @ normals[0])[:, None] * normals[0] - view
    assert share_of_mirrored(mesh_of((corners, normals))) == pytest.approx((mirrored[:, 2] < 0.0).mean(), abs=3e-3)


def test_faces_count_by_their_area() -> None:
    leaning, flat = triangle(np.radians(60.0)), triangle(0.0, size=3.0)
    assert share_of_mirrored(mesh_of(leaning, flat)) == pytest.approx(0.75 / 10.0, rel=1e-4)
    assert share_of_mirrored(mesh_of(triangle(0.7, size=0.0))) == 0.0


@pytest.mark.parametrize(("segments", "leans"), [(8, True), (16, True), (48, False)])
def test_coarse_balls_lean_and_fine_ones_do_not(segments: int, leans: bool) -> None:
    assert normals_lean(ball(segments)) == leans


def ball(segments: int) -> TriangleMesh:
    """A sphere of segments and half as many rings, whose normals are its directions."""
    theta, phi = np.linspace(0.0, np.pi, segments // 2 + 1), np.linspace(0.0, 2.0 * np.pi, segments + 1)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    points: Any = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=2)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.concatenate([np.stack(x, axis=2).reshape(-1, 3) for x in ((a, b, c), (a, c, d))])
    return mesh_of(*((each, each) for each in corners.reshape(-1, 3, 3)))
