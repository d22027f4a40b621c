# SPDX-License-Identifier: Apache-2.0
"""What rays straight from the camera meet: shapes whose attribute `CAMERA_HIDDEN` is 1 are not there for them.

That is the ray visibility of Blender's objects. A ray that surfaces have let through unchanged is still the camera's.
Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from .ray_starts import RayStarts
from .smooth_facets import shape_number, shape_table

CAMERA_HIDDEN = "camera_hidden"


class CameraView:
    """The shapes of a scene that the camera does not see."""

    def __init__(self, scene: mi.Scene) -> None:
        hidden = [shape for shape in scene.shapes() if shape_number(shape, CAMERA_HIDDEN) == 1.0]
        self._scene = scene
        self.hides, self._starts = bool(hidden), RayStarts(scene)
        self._table = shape_table(hidden, [1] * len(hidden), mi.UInt32) if hidden else None

    def met(self, ray: mi.Ray3f, active: Any = True, *, straight: Any = True) -> mi.PreliminaryIntersection3f:
        """The first surface on `ray`, and of rays that come `straight` from the camera the first that it sees."""
        found = self._scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        return self._seen(mi.Ray3f(ray), found, mi.Bool(active) & straight) if self.hides else found

    @dr.syntax
    def _seen(
        self, ray: mi.Ray3f, found: mi.PreliminaryIntersection3f, active: mi.Bool
    ) -> mi.PreliminaryIntersection3f:
        table, starts, start = self._table, self._starts, mi.Point3f(ray.o)
        number = dr.reinterpret_array(mi.UInt32, found.shape)
        known = active & found.is_valid() & (number < dr.opaque(mi.UInt32, dr.width(table)))
        passing = known & (dr.gather(mi.UInt32, table, number, known) == 1)
        passed = mi.Bool(passing)
        while dr.hint(passing, label="hidden from the camera"):
            si = found.compute_surface_interaction(ray, mi.RayFlags.Minimal, passing)
            onward = starts.ray(si, ray.d)
            onward.maxt = ray.maxt - si.t
            ray = dr.select(passing, onward, ray)
            found = dr.select(passing, self._scene.ray_intersect_preliminary(ray, active=passing), found)
            number = dr.reinterpret_array(mi.UInt32, found.shape)
            known = passing & found.is_valid() & (number < dr.opaque(mi.UInt32, dr.width(table)))
            passing = known & (dr.gather(mi.UInt32, table, number, known) == 1)
        # a ray is spawned a little above the surface that it passes
        passed &= found.is_valid()
        si = found.compute_surface_interaction(ray, mi.RayFlags.Minimal, passed)
        found.t = dr.select(passed, dr.dot(si.p - start, ray.d), found.t)
        return found
