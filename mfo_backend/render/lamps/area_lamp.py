# SPDX-License-Identifier: Apache-2.0
"""Area lights with their spread (Cycles 4.3 to 5.2, kernel/light/area.h, scene/light.cpp).

The spread is that of a grid in front of a soft box: at angle a to the axis light is (T - tan a) / (T - h) times the
radiance, h half the spread and T its tangent, which leaves the power as it is. Choose the variant before importing.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .lamp import Crossing, Lamp, matrix_of, opaque_vector

SERIES_BELOW = 0.05  # half spread, radians; Cycles takes h^3 / 3 for T - h there
MOST = 1e15  # a tangent that float32 can square
RIM = 1 + 1e-5  # rounding, at the rim of a sampled shape


class AreaLamp(Lamp):
    """Further properties: `round` (false) and `spread` in degrees (180). `to_world` maps the square from -1 to 1."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.round = bool(props.get("round", False))
        half = math.radians(float(props.get("spread", 180.0))) / 2.0
        tangent = min(math.tan(half), MOST) if half < 0.5 * math.pi else MOST
        self.parallel = half <= 0.0
        if self.parallel:
            self.m_flags = mi.EmitterFlags.DeltaDirection
        matrix = matrix_of(props)
        self.center = mi.Point3f(opaque_vector(matrix[:3, 3]))
        lengths = np.linalg.norm(matrix[:3, :3], axis=0)
        self.u, self.v, self.n = (opaque_vector(matrix[:3, k] / lengths[k]) for k in range(3))
        self.half_u, self.half_v = (dr.opaque(mi.Float, float(lengths[k])) for k in range(2))
        self.area = dr.opaque(mi.Float, float(lengths[0] * lengths[1]) * (math.pi if self.round else 4.0))
        self.tangent = dr.opaque(mi.Float, tangent)
        scale = tangent - half if half > SERIES_BELOW else half**3 / 3.0
        self.scale = dr.opaque(mi.Float, 0.0 if self.parallel else min(1.0 / scale, 1e30))

    def frame(self, linear: np.ndarray) -> np.ndarray:
        """See `Lamp`: without the light's size."""
        return linear / np.linalg.norm(linear, axis=0)

    def towards(self, point: mi.Point3f, u: mi.Point2f) -> mi.Vector3f:
        """See `Lamp`. A point of the light, or where that is smaller, of the disk whose light reaches `point`."""
        line = point - self.center
        radius = dr.maximum(dr.dot(line, self.n), 0) * self.tangent
        disk = mi.warp.square_to_uniform_disk_concentric(u)
        narrow = self._is_narrow(radius)
        whole = disk if self.round else 2 * u - 1
        x = dr.select(narrow, dr.dot(line, self.u) + radius * disk.x, self.half_u * whole.x)
        y = dr.select(narrow, dr.dot(line, self.v) + radius * disk.y, self.half_v * whole.y)
        return dr.normalize(x * self.u + y * self.v - line)

    def crossing(self, point: mi.Point3f, direction: mi.Vector3f) -> Crossing:
        """See `Lamp`. It shines on one side."""
        line = point - self.center
        height = dr.dot(line, self.n)
        cosine = -dr.dot(direction, self.n)
        way = height / cosine
        x, y = self._on_square(line + way * direction)
        hit = (height > 0) & (cosine > 0) & self._is_inside(x, y)
        short = self.tangent - dr.norm(direction + cosine * self.n) / cosine
        radius = height * self.tangent
        area = dr.select(self._is_narrow(radius), dr.pi * dr.square(radius), self.area)
        factor = self.pattern.of(short * self.scale, way, -direction, (x, y))
        return Crossing(hit & (short > 0), way, dr.square(way) / (cosine * area), factor)

    def sample_direction(
        self, it: mi.Interaction3f, sample: mi.Point2f, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        """See `mi.Emitter`. Without spread the light is a parallel beam, pi times the radiance."""
        if not self.parallel:
            return super().sample_direction(it, sample, active)
        line = it.p - self.center
        height = dr.dot(line, self.n)
        x, y = self._on_square(line)
        hit = (height > 0) & self._is_inside(x, y)
        beam = Crossing(hit, height, mi.Float(1), self.pattern.of(mi.Float(dr.pi), height, self.n, (x, y)))
        return self._sampled(it, -self.n, height, beam, hit & active)

    def _on_square(self, place: mi.Vector3f) -> tuple[mi.Float, mi.Float]:
        return dr.dot(place, self.u) / self.half_u, dr.dot(place, self.v) / self.half_v

    def _is_inside(self, x: mi.Float, y: mi.Float) -> mi.Bool:
        if self.round:
            return x * x + y * y <= RIM
        return (dr.abs(x) <= RIM) & (dr.abs(y) <= RIM)

    def _is_narrow(self, radius: mi.Float) -> mi.Bool:
        return dr.pi * dr.square(radius) < self.area
