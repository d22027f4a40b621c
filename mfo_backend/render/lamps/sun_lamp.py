# SPDX-License-Identifier: Apache-2.0
"""A sun with an angle: a disk of the sky of equal radiance (Cycles 4.3 to 5.2, kernel/light/sun.h, before 5.1
distant.h). Choose the variant before importing this."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from .lamp import Crossing, Lamp, cone_direction, matrix_of, opaque_vector


class SunLamp(Lamp):
    """Further property: `angle`, the full angle of the disk in degrees, above 0. Only the axis of `to_world` counts."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        half = math.radians(float(props["angle"])) / 2.0
        axis = matrix_of(props)[:3, 2]
        self.axis = opaque_vector(-axis / np.linalg.norm(axis))
        self.less = dr.opaque(mi.Float, 2.0 * math.sin(half / 2.0) ** 2)

    def towards(self, point: mi.Point3f, u: mi.Point2f) -> mi.Vector3f:
        """See `Lamp`."""
        return cone_direction(self.axis, self.less, u)

    def crossing(self, point: mi.Point3f, direction: mi.Vector3f) -> Crossing:
        """See `Lamp`."""
        # |d - a|^2 = 2 (1 - cos), exact for small angles
        hit = dr.squared_norm(direction - self.axis) <= 2 * self.less * (1 + 1e-5)
        return Crossing(hit, mi.Float(dr.inf), dr.inv_two_pi / self.less, mi.Float(1))
