# SPDX-License-Identifier: Apache-2.0
"""Where rays start that leave a surface: a little above it, so that they do not meet it again.

Mitsuba starts them `EPSILON` (1 + d) above, d the distance from zero, whatever the size of what they leave: 0.09 mm is
a tenth of a ball of 1 mm. Here a small shape counts by its own size. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .smooth_facets import shape_table

# mitsuba/core/math.h, RayEpsilon: 1,500 half steps of a float at 1. Of two million rays from balls, tilted planes and
# a ball of 1 mm half a metre away none meets what it left with 4 of these; from triangles 500 and 5,000 times as long
# as wide none does with 32
EPSILON = 1500.0 * 2.0**-24
# Of a shape's reach: a floor at height 0 beside a wall was found less well with 0.01 and with 0; why is not known
LEAST = 0.1
SHADOW_EPSILON = 10.0 * EPSILON  # of the way to a light, as Mitsuba's


class RayStarts:
    """Of all shapes of a scene; those of instances are left to Mitsuba."""

    def __init__(self, scene: mi.Scene) -> None:
        shapes = list(scene.shapes())
        boxes = [shape.bbox() for shape in shapes]
        farthest = [np.maximum(np.abs(np.ravel(box.min)), np.abs(np.ravel(box.max))) for box in boxes]
        self._reach = [shape_table(shapes, [far[k] for far in farthest], mi.Float) for k in range(3)]

    def ray(self, si: mi.SurfaceInteraction3f, direction: mi.Vector3f) -> mi.Ray3f:
        """As `si.spawn_ray`."""
        return mi.Ray3f(self._start(si, mi.Point3f(si.p), direction), direction, dr.inf, si.time, si.wavelengths)

    def ray_to(self, si: mi.SurfaceInteraction3f, end: mi.Point3f, lift: Any = 0.0) -> mi.Ray3f:
        """As `si.spawn_ray_to`, from a point `lift` away from `si`."""
        point = mi.Point3f(si.p + lift)
        start = self._start(si, point, end - point)
        way = end - start
        far = dr.norm(way)
        return mi.Ray3f(start, way / far, far * (1.0 - SHADOW_EPSILON), si.time, si.wavelengths)

    def _start(self, si: mi.SurfaceInteraction3f, point: mi.Point3f, direction: mi.Vector3f) -> mi.Point3f:
        number = dr.reinterpret_array(mi.UInt32, si.shape)
        known = number < dr.opaque(mi.UInt32, dr.width(self._reach[0]))
        reach = mi.Vector3f(*(dr.gather(mi.Float, axis, number, known) for axis in self._reach))
        usual = 1.0 + dr.max(dr.abs(point))
        # a point of a triangle is off by steps of its corners' coordinates, of which the normal's part leaves the plane
        along = dr.maximum(dr.dot(dr.abs(si.n), reach), LEAST * dr.max(reach))
        size = dr.select(dr.max(reach) > 0, dr.minimum(usual, along), usual)
        return point + mi.Vector3f(si.n) * dr.mulsign(EPSILON * size, dr.dot(si.n, direction))
