# SPDX-License-Identifier: Apache-2.0
"""Point and spot lights with a radius (Cycles 4.3 to 5.2, kernel/light/point.h and spot.h).

Without Soft Falloff the lamp is a sphere of equal radiance; with it a disk of that radius which always faces the
shaded point, so that irradiance nearby grows no further than to d = r. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from copy import copy
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .lamp import Crossing, Lamp, cone_direction, matrix_of, opaque_color, opaque_vector
from .lamp_pattern import LampPattern


class PointLamp(Lamp):
    """Further properties: `radius` (metres, above 0) and `soft_falloff` (true). Only the place of `to_world` counts,
    and for a pattern its rotation and scale."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.soft = bool(props.get("soft_falloff", True))
        self.radius = dr.opaque(mi.Float, float(props["radius"]))
        self.center = mi.Point3f(opaque_vector(matrix_of(props)[:3, 3]))

    def towards(self, point: mi.Point3f, u: mi.Point2f) -> mi.Vector3f:
        """See `Lamp`."""
        line = self.center - point
        distance = dr.norm(line)
        axis = line / distance
        if self.soft:
            on_disk = self.radius * mi.warp.square_to_uniform_disk_concentric(u)
            return dr.normalize(mi.Frame3f(axis).to_world(mi.Vector3f(on_disk.x, on_disk.y, distance)))
        inside = distance <= self.radius
        outer = cone_direction(axis, self._cone(distance), u)
        return dr.select(inside, mi.warp.square_to_uniform_sphere(u), outer)

    def crossing(self, point: mi.Point3f, direction: mi.Vector3f) -> Crossing:
        """See `Lamp`."""
        line = self.center - point
        distance = dr.norm(line)
        along = dr.dot(line, direction)
        if self.soft:
            cosine = along / distance
            way = distance / cosine
            aside = dr.norm(direction - cosine * (line / distance)) * way
            hit = (cosine > 0) & (aside <= self.radius * (1 + 1e-5))  # rounding, at the rim of a sampled disk
            density = dr.square(way) / (dr.pi * dr.square(self.radius) * cosine)
            return Crossing(hit, way, density, self.pattern.of(mi.Float(1), way, -direction))
        inside = distance <= self.radius
        least = dr.squared_norm(line - along * direction)
        depth = dr.square(self.radius) - least
        half = dr.safe_sqrt(depth)
        hit = (depth >= -2e-5 * dr.square(self.radius)) & (inside | (along > 0))
        density = dr.select(inside, dr.inv_four_pi, dr.inv_two_pi / self._cone(distance))
        way = along + dr.select(inside, half, -half)
        away = dr.normalize(way * direction - line) if self.pattern.by == "normal" else -direction
        return Crossing(hit, way, density, self.pattern.of(mi.Float(1), way, away))

    def _cone(self, distance: mi.Float) -> mi.Float:
        """1 - cos of the half angle under which the sphere appears."""
        square = dr.minimum(dr.square(self.radius / distance), 1)
        return square / (1 + dr.safe_sqrt(1 - square))


class SpotCone:
    """The factor of a spot's cone: smoothstep of the cosine from the rim inwards, in the light's scaled space.

    Properties: `cone` (full angle in degrees) and `blend` in [0, 1], whose 0 is a sharp rim.
    """

    def __init__(self, props: mi.Properties) -> None:
        rim = math.cos(math.radians(float(props["cone"])) / 2.0)
        self.rim = dr.opaque(mi.Float, rim)
        self.soft = dr.opaque(mi.Float, max((1.0 - rim) * float(props["blend"]), 1e-9))
        inverse = np.linalg.inv(matrix_of(props)[:3, :3])
        self.rows = [opaque_vector(row) for row in inverse]

    def turned(self, turn: np.ndarray) -> SpotCone:
        """The cone after a rotation (3, 3) of the lamp."""
        other = copy(self)
        other.rows = [opaque_vector(turn @ np.array(row, np.float64).ravel()) for row in self.rows]
        return other

    def factor(self, direction: mi.Vector3f) -> mi.Float:
        """The factor for light that arrives along the line `direction`, which points to the lamp."""
        local = mi.Vector3f(*(-dr.dot(row, direction) for row in self.rows))
        t = dr.clip((dr.normalize(local).z - self.rim) / self.soft, 0, 1)
        return t * t * (3 - 2 * t)


class SpotLamp(PointLamp):
    """A point light with the properties of `SpotCone`; `to_world` may scale, which deforms the cone."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.cone = SpotCone(props)

    def crossing(self, point: mi.Point3f, direction: mi.Vector3f) -> Crossing:
        """See `Lamp`. Inside the sphere there is no cone."""
        found = super().crossing(point, direction)
        factor = self.cone.factor(direction)
        if not self.soft:
            factor = dr.select(dr.squared_norm(self.center - point) <= dr.square(self.radius), 1, factor)
        return Crossing(found.hit, found.distance, found.density, found.factor * factor)


class SharpSpot(mi.Emitter):
    """A spot light of no extent: `intensity` (W/sr, linear Rec.709), `to_world`, the properties of `SpotCone`
    and `LampPattern`, and `shadow`, as of all lamps."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.m_flags = mi.EmitterFlags.DeltaPosition
        self.intensity = opaque_color(props["intensity"])
        self.shadow = bool(props.get("shadow", True))
        self.center = mi.Point3f(opaque_vector(matrix_of(props)[:3, 3]))
        self.cone = SpotCone(props)
        self.pattern = LampPattern(props, matrix_of(props)[:3, :3])

    def sample_direction(
        self, it: mi.Interaction3f, sample: mi.Point2f, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        """See `mi.Emitter`."""
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = self.center
        line = self.center - it.p
        ds.dist = dr.norm(line)
        ds.d = line / ds.dist
        ds.n, ds.time, ds.pdf, ds.delta = -ds.d, it.time, 1.0, True
        ds.emitter = mi.EmitterPtr(self)
        factor = self.pattern.of(self.cone.factor(ds.d), ds.dist, -ds.d)
        value = self.intensity * (factor / dr.square(ds.dist))
        return ds, dr.select(mi.Bool(active), value, 0)

    def pdf_direction(self, it: mi.Interaction3f, ds: mi.DirectionSample3f, active: Any = True) -> mi.Float:
        """0: no ray meets a point."""
        return mi.Float(0)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> mi.Color3f:
        """Nothing: a lamp is no surface."""
        return mi.Color3f(0)

    def bbox(self) -> mi.ScalarBoundingBox3f:
        """Empty."""
        return mi.ScalarBoundingBox3f()

    def to_string(self) -> str:
        """Short description."""
        return f"SharpSpot[intensity={self.intensity}]"
