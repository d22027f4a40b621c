# SPDX-License-Identifier: Apache-2.0
"""Flat and smooth faces beside each other, and what sharp edges make of them: shading against Cycles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ..scenes import add_camera, add_light, add_mesh, add_quad, diffuse_material, new_material


@pytest.mark.parametrize("kind", ["flat", "flat beside smooth", "custom normals", "sharp edges", "sharp edges alone"])
def test_a_face_that_is_not_plane_shades_as_in_cycles(
    kind: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    corners = [(-1, -1, 0), (1, -1, 0.8), (1, 1, 0), (-1, 1, 0.8), (3, -1, 0), (3, 1, 0)]
    white = diffuse_material("White", (0.8, 0.8, 0.8))
    bent = add_mesh("Bent", corners, [(0, 1, 2, 3), (1, 4, 5, 2)], white)
    bent.cycles.shadow_terminator_geometry_offset = 0.0
    first, second = bent.data.polygons
    by_edges = kind.startswith("sharp")
    first.use_smooth, second.use_smooth = by_edges, by_edges or kind == "flat beside smooth"
    for edge in bent.data.edges:
        edge.use_edge_sharp = by_edges
    if kind.endswith("alone"):
        bent.data.attributes.remove(bent.data.attributes["sharp_face"])
    if kind == "custom normals":
        bent.data.normals_split_custom_set([(0.3, 0.0, 1.0)] * 8)
    target = add_quad("Target", 0.05, 2.0, new_material("Target"))
    target.location.x = -0.9
    add_light("SUN", rotation=(0.9, 0.3, 0), energy=3.0)
    add_camera("ORTHO", ortho_scale=2.0)
    scene.render.resolution_x = scene.render.resolution_y = 16
    expected, found = render_cycles(), render_mitsuba(export(target))
    # but for the pixels along the diagonal, and the target
    assert np.quantile(np.abs(found - expected), 0.8) < 1e-3
    if kind.startswith("flat") or kind.endswith("alone"):
        assert expected.max() > 4.0 * np.median(expected[10:, 10:])  # two planes


@pytest.mark.parametrize("sharp", [False, True], ids=["no sharp edge", "a sharp edge"])
@pytest.mark.parametrize("smooth", [(False, True, False), (True, True, False), (True, False, True)])
def test_smooth_faces_beside_flat_ones_shade_as_in_cycles(
    smooth: tuple[bool, ...], sharp: bool, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """As a Boolean modifier makes them: three quads in an arch that share their edges."""
    places = [(-1.4, -0.5), (-0.5, 0.0), (0.5, 0.0), (1.4, -0.5)]
    corners = [(x, y, z) for x, z in places for y in (-1.0, 1.0)]
    faces = [(k, k + 2, k + 3, k + 1) for k in (0, 2, 4)]
    arch = add_mesh("Arch", corners, faces, diffuse_material("White", (0.8, 0.8, 0.8)))
    arch.cycles.shadow_terminator_geometry_offset = 0.0
    for polygon, value in zip(arch.data.polygons, smooth, strict=True):
        polygon.use_smooth = value
    for edge in arch.data.edges:
        edge.use_edge_sharp = sharp and set(edge.vertices) == {2, 3}
    target = add_quad("Target", 0.05, 2.0, new_material("Target"))
    target.location.x = -0.9
    add_light("SUN", rotation=(0.0, 0.9, 0), energy=3.0)
    add_camera("ORTHO", ortho_scale=2.6)
    expected, found = render_cycles(), render_mitsuba(export(target))
    assert np.quantile(np.abs(found - expected), 0.8) < 2e-3  # but for pixels at edges, and the target
