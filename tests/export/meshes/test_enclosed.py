# SPDX-License-Identifier: Apache-2.0
"""Closed meshes and what they have inside. Oracle: a ball and a torus, whose inside is known."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from blender_addon.export.files.ply_file import TriangleMesh
from blender_addon.export.meshes import enclosed
from blender_addon.export.meshes.mesh_arrays import turned, world_mesh
from blender_addon.export.meshes.read_mesh import read_mesh


def mesh_of(**torus: float) -> TriangleMesh:
    bpy.ops.mesh.primitive_torus_add(major_segments=64, minor_segments=32, **torus)
    bpy.context.view_layer.update()
    mesh = read_mesh(bpy.context.object, bpy.context.evaluated_depsgraph_get())
    assert mesh is not None
    return world_mesh(mesh, np.ones(len(mesh.slots), bool), np.eye(4))


@pytest.mark.parametrize("at_once", [enclosed.MOST_AT_ONCE, 50_000])
def test_points_inside_a_torus_and_in_its_hole(scene: object, monkeypatch: pytest.MonkeyPatch, at_once: int) -> None:
    monkeypatch.setattr(enclosed, "MOST_AT_ONCE", at_once)
    torus = mesh_of(major_radius=1.0, minor_radius=0.25)
    points = np.random.default_rng(0).uniform(-1.3, 1.3, (300, 3)) * (1.0, 1.0, 0.25)
    away = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2])
    points, away = points[np.abs(away - 0.25) > 0.02], away[np.abs(away - 0.25) > 0.02]  # its facets cut corners
    inside = (away < 0.25).astype(float)
    assert 20 < inside.sum() < len(points) - 20
    np.testing.assert_allclose(enclosed.winding_numbers(torus, points), inside, atol=1e-6)
    np.testing.assert_allclose(enclosed.winding_numbers(turned(torus, 0.0), points), -inside, atol=1e-6)


def test_a_torus_is_closed_until_it_loses_a_face_and_looks_outwards_until_it_is_turned(scene: object) -> None:
    torus = mesh_of(major_radius=1.0, minor_radius=0.25)
    assert enclosed.is_closed(torus)
    assert enclosed.looks_outwards(torus)
    assert not enclosed.looks_outwards(turned(torus, 0.0))
    cut = TriangleMesh(torus.positions, torus.normals, torus.uvs, torus.triangles[1:])
    assert not enclosed.is_closed(cut)
