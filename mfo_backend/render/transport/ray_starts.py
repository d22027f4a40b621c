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

# mitsuba/core/math.h, RayEpsilon: 1,500 half steps of a float at 1
EPSILON = 1500.0 * 2.0**-24
SHADOW_EPSILON = 10.0 * EPSILON  # of the way to a light, as Mitsuba's
# Metres: shapes that reach no further from zero are small. Rays start `EPSILON` of their reach above them, as many
# steps of a float as Mitsuba's at 1. With Mitsuba's a scene of millimetres was 0.83 % darker than in Cycles and one of
# centimetres 0.12 %; both are within 0.02 % (docs/notebook/differential.md). Larger ones are as before
SMALL = 0.1


class RayStarts:
    """Of all shapes of a scene; those of instances are left to Mitsuba."""

    def __init__(self, scene: mi.Scene) -> None:
        shapes = list(scene.shapes())
        boxes = [shape.bbox() for shape in shapes]
        reach = [float(np.max(np.abs([np.ravel(box.min), np.ravel(box.max)]))) for box in boxes]
        small = [(shape, far) for shape, far in zip(shapes, reach, strict=True) if 0.0 < far <= SMALL]
        self.are_usual = not small
        self._reach = None if self.are_usual else shape_table(*map(list, zip(*small, strict=True)), mi.Float)

    def ray(self, si: mi.SurfaceInteraction3f, direction: mi.Vector3f) -> mi.Ray3f:
        """As `si.spawn_ray`."""
        if self.are_usual:
            return si.spawn_ray(direction)
        return mi.Ray3f(self._start(si, mi.Point3f(si.p), direction), direction, dr.inf, si.time, si.wavelengths)

    def ray_to(self, si: mi.SurfaceInteraction3f, end: mi.Point3f, lift: Any = 0.0) -> mi.Ray3f:
        """As `si.spawn_ray_to`, from a point `lift` away from `si`."""
        if self.are_usual:
            lifted = mi.Interaction3f(si)
            lifted.p = si.p + lift
            return lifted.spawn_ray_to(end)
        point = mi.Point3f(si.p + lift)
        start = self._start(si, point, end - point)
        way = end - start
        far = dr.norm(way)
        return mi.Ray3f(start, way / far, far * (1.0 - SHADOW_EPSILON), si.time, si.wavelengths)

    def _start(self, si: mi.SurfaceInteraction3f, point: mi.Point3f, direction: mi.Vector3f) -> mi.Point3f:
        number = dr.reinterpret_array(mi.UInt32, si.shape)
        known = number < dr.opaque(mi.UInt32, dr.width(self._reach))
        reach = dr.gather(mi.Float, self._reach, number, known)
        size = dr.select(reach > 0.0, reach, 1.0 + dr.max(dr.abs(point)))
        return point + mi.Vector3f(si.n) * dr.mulsign(EPSILON * size, dr.dot(si.n, direction))
