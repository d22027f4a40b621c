# SPDX-License-Identifier: Apache-2.0
"""Shared corners and moved normals, against the plain rule applied to every corner. No bpy here."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def arrays() -> ModuleType:
    """`mesh_arrays` by itself: its package needs bpy, which has no part in this."""
    modules = {}
    for name in ("files.ply_file", "meshes.mesh_arrays"):
        path = (ROOT / "blender_addon" / "export").joinpath(*name.split(".")).with_suffix(".py")
        spec = importlib.util.spec_from_file_location(f"export_without_bpy.{name}", path)
        assert spec is not None
        assert spec.loader is not None
        modules[name] = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = modules[name]
        spec.loader.exec_module(modules[name])
    return modules["meshes.mesh_arrays"]


MATRIX = np.array([[1.2, 0.3, -0.5, 1.0], [-0.4, 0.9, 0.2, 2.0], [0.1, -0.7, 1.5, 3.0], [0.0, 0.0, 0.0, 1.0]])
MATRICES = {
    "turned and sheared": MATRIX,
    "mirrored": MATRIX @ np.diag([1.0, -1.0, 1.0, 1.0]),
    "flat": np.diag([1.0, 1.0, 0.0, 1.0]),
    "a line": np.diag([1.0, 0.0, 0.0, 1.0]),
}


def grid(count: int, without_normal: int) -> dict[str, np.ndarray]:
    """Corners of a wavy grid of 2 * count**2 triangles; some vertices have no normal."""
    line = np.linspace(-2.0, 2.0, count + 1, dtype=np.float32)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    points = np.stack([x, y, np.sin(3 * x) * np.cos(2 * y)], axis=1).astype(np.float32)
    normals = np.stack([-np.cos(x), -np.sin(y), np.ones_like(x)], axis=1)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    normals[:without_normal] = 0.0
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    quads = np.stack([first, first + 1, first + count + 2, first, first + count + 2, first + count + 1], axis=1)
    corners = quads.reshape(-1, 3)
    uvs = (points[:, :2] / 4 + 0.5).astype(np.float32)
    each = {"positions": points[corners], "normals": normals[corners], "uvs": uvs[corners]}
    return {**each, "vertices": corners.astype(np.int32)}


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
@pytest.mark.parametrize("without_normal", [0, 3])
def test_every_corner_is_moved_as_one(arrays: ModuleType, matrix: np.ndarray, without_normal: int) -> None:
    corners = grid(12, without_normal)
    count = len(corners["positions"])
    chosen = np.arange(count) % 7 != 0
    mesh = arrays.CornerMesh(**corners, slots=np.zeros(count, np.int32))
    moved = arrays.world_mesh(mesh, chosen, matrix)

    linear, sign = matrix[:3, :3], -1.0 if np.linalg.det(matrix[:3, :3]) < 0 else 1.0
    positions = corners["positions"][chosen].astype(np.float64) @ linear.T + matrix[:3, 3]
    a, b, c = linear
    normals = sign * corners["normals"][chosen] @ np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)]).T
    faces = sign * np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    lengths = np.linalg.norm(faces, axis=1, keepdims=True)
    faces = np.where(lengths > 1e-30, faces / np.maximum(lengths, 1e-30), (0.0, 0.0, 1.0))
    lengths = np.linalg.norm(normals, axis=2, keepdims=True)
    normals = np.where(lengths > 1e-20, normals / np.maximum(lengths, 1e-20), faces[:, None])
    uvs = corners["uvs"][chosen] * (1.0, -1.0) + (0.0, 1.0)

    order = slice(None, None, -1 if sign < 0 else 1)
    # float32 of values up to 7, whose last digit is 5e-7
    np.testing.assert_allclose(moved.positions[moved.triangles], positions[:, order], atol=1e-6)
    np.testing.assert_allclose(moved.normals[moved.triangles], normals[:, order], atol=1e-6)
    np.testing.assert_allclose(moved.uvs[moved.triangles], uvs[:, order], atol=1e-6)
    if not without_normal and lengths.min() > 1e-20:
        assert len(moved.positions) == len(np.unique(corners["positions"][chosen].reshape(-1, 3), axis=0))


@pytest.mark.parametrize("chosen", ["all", "some", "none"])
def test_sharing_by_vertices_is_that_of_all_corners_bit_by_bit(arrays: ModuleType, chosen: str) -> None:
    """With seams, NaN, both zeros, and two vertices in one place."""
    corners = grid(9, 2)
    random = np.random.default_rng(5)
    corners["uvs"][random.random(corners["uvs"].shape[:2]) < 0.3] = 0.25
    corners["positions"][random.random(corners["positions"].shape) < 0.2] = -0.0
    corners["normals"][7, 1] = np.nan
    corners["vertices"][corners["vertices"] == 40] = 99
    faces = {"all": np.ones, "none": np.zeros}.get(chosen, lambda n, _t: np.arange(n) % 3 > 0)(162, bool)
    mesh = arrays.CornerMesh(**corners, slots=np.zeros(162, np.int32))
    rows, index = arrays._shared_corners(mesh, faces)
    parts = [corners[name][faces].reshape(-1, width) for name, width in (("positions", 3), ("normals", 3), ("uvs", 2))]
    plain_rows, plain_index = arrays._shared(np.concatenate(parts, axis=1))
    assert rows.tobytes() == plain_rows.tobytes()
    assert np.array_equal(index, plain_index)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, 1e18])
def test_a_piece_tells_what_it_leaves_out(arrays: ModuleType, value: float) -> None:
    corners = grid(4, 0)
    corners["positions"][3:6, 1, 0] = value
    faces = np.arange(32) != 4
    piece = arrays.Piece(arrays.CornerMesh(**corners, slots=np.zeros(32, np.int32)), faces, MATRIX)
    placed = piece.placed()
    assert piece.left_out() == len(piece) - len(placed.triangles) == (2 if value else 0)
    found = np.concatenate(list(piece.corners()))
    np.testing.assert_allclose(found, placed.positions[placed.triangles], atol=1e-6)


def test_two_rows_with_one_hash_stay_two(arrays: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "_FACTOR", np.uint64(0))
    rows = np.random.default_rng(3).integers(0, 2, (64, 8)).astype(np.float32)
    distinct, index = arrays._shared(rows)
    assert np.array_equal(distinct[index], rows)
    assert len(distinct) == len(np.unique(rows, axis=0))


def test_minus_zero_is_zero(arrays: ModuleType) -> None:
    rows = np.zeros((2, 8), np.float32)
    rows[1] = -0.0
    assert len(arrays._shared(rows)[0]) == 1


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_triangles_out_of_reach_are_left_out(arrays: ModuleType, value: float) -> None:
    corners = grid(4, 0)
    corners["positions"] = corners["positions"].copy()
    corners["positions"][5, 1, 0] = value
    corners["uvs"] = corners["uvs"].copy()
    corners["uvs"][7, 0, 0] = np.nan
    mesh = arrays.CornerMesh(**corners, slots=np.zeros(32, np.int32))
    moved = arrays.world_mesh(mesh, np.ones(32, bool), MATRIX)
    assert moved.triangles.shape == (31, 3)
    assert all(np.isfinite(part).all() for part in (moved.positions, moved.normals, moved.uvs))
    mesh.positions[:] = value
    assert len(arrays.world_mesh(mesh, np.ones(32, bool), MATRIX).triangles) == 0
