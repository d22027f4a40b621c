# SPDX-License-Identifier: Apache-2.0
"""Points on the faces of a mesh, evenly by area, for light samples.

Mitsuba's own have the bent normals of a smooth mesh, and its densities by direction go with these. Choose the variant
before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory


@dataclass(frozen=True)
class FacePoints:
    """The faces of a mesh: how much area there is up to each, their corners, and those on a texture if there are."""

    up_to: Any
    faces: Any
    positions: Any
    coordinates: Any

    @staticmethod
    def of(mesh: Any) -> FacePoints:
        """Those of a mesh as it is in the world."""
        faces = np.array(mesh.faces_buffer()).reshape(-1, 3)
        a, b, c = np.array(mesh.vertex_positions_buffer(), np.float64).reshape(-1, 3)[faces.T]
        areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        coordinates = mesh.vertex_texcoords_buffer() if mesh.has_vertex_texcoords() else None
        return FacePoints(
            own_memory(np.cumsum(areas), mi.Float), mesh.faces_buffer(), mesh.vertex_positions_buffer(), coordinates
        )

    def sample(self, it: mi.Interaction3f, u: mi.Point2f, active: mi.Bool) -> mi.DirectionSample3f:
        """A point and its density by solid angle from `it`; its normal is that of the face."""
        last = dr.width(self.up_to) - 1
        total = dr.gather(mi.Float, self.up_to, mi.UInt32(last))
        reached = u.x * total
        face = dr.binary_search(0, last, lambda k: dr.gather(mi.Float, self.up_to, k, active) < reached)
        before = dr.gather(mi.Float, self.up_to, face - 1, active & (face > 0))
        width = dr.gather(mi.Float, self.up_to, face, active) - before
        rest = dr.clip((reached - before) / dr.maximum(width, 1e-30), 0.0, 1.0)
        s, t = mi.warp.square_to_uniform_triangle(mi.Point2f(rest, u.y))
        corners = dr.gather(mi.Vector3u, self.faces, face, active)
        a, b, c = (dr.gather(mi.Point3f, self.positions, corner, active) for corner in corners)
        ds = dr.zeros(mi.DirectionSample3f, dr.width(u))
        ds.p, ds.n, ds.time = a + (b - a) * s + (c - a) * t, dr.normalize(dr.cross(b - a, c - a)), it.time
        if self.coordinates is not None:
            a, b, c = (dr.gather(mi.Point2f, self.coordinates, corner, active) for corner in corners)
            ds.uv = a + (b - a) * s + (c - a) * t
        ds.d = ds.p - it.p
        squared = dr.squared_norm(ds.d)
        ds.dist = dr.sqrt(squared)
        ds.d /= ds.dist
        density = squared / (dr.abs(dr.dot(ds.d, ds.n)) * total)
        ds.pdf = dr.select(active & dr.isfinite(density), density, 0.0)
        return ds
