# SPDX-License-Identifier: Apache-2.0
"""What all of Blender's lights share: light without a shape, so that nothing is blocked by it.

Cycles 4.3 to 5.2 (kernel/light/light.h, kernel/integrator/intersect_closest.h): a ray goes on through the lights it
meets, and shadow rays do not see them. So a lamp is an emitter alone. A ray that a material has sent out meets it where
`eval_direction` is not black; integrators that know lamps (`met_lamps`) add that light. For those that do not, such as
Mitsuba's `path`, a sample says it is a `delta` one, so that light samples carry all of it: equal in the mean, but
noisy for shiny materials, and black in mirrors. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .lamp_pattern import LampPattern


@dataclass(frozen=True)
class Crossing:
    """Where lines from a point cross a lamp: `distance` (infinite for a sun), whether they do, density per solid angle
    of `Lamp.towards` for that direction, and `factor` of the lamp's radiance, one number or a colour."""

    hit: Any
    distance: Any
    density: Any
    factor: Any


class Lamp(mi.Emitter):
    """Properties of all lamps: `radiance` (linear Rec.709), `to_world` (it shines along +Z), `camera` (false): whether
    camera rays see it, `shadow` (true): whether its light casts shadows, and those of `LampPattern`.

    Each kind has its own `towards`, a unit direction from a point to the lamp for random numbers in [0, 1), and
    `crossing`, what a line from a point along a unit vector meets.
    """

    towards: Callable[[mi.Point3f, mi.Point2f], mi.Vector3f]
    crossing: Callable[[mi.Point3f, mi.Vector3f], Crossing]

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.pattern = LampPattern(props, self.frame(matrix_of(props)[:3, :3]))
        self.m_flags = mi.EmitterFlags.SpatiallyVarying
        self.radiance = opaque_color(props["radiance"])
        self.camera = bool(props.get("camera", False))
        self.shadow = bool(props.get("shadow", True))

    def frame(self, linear: np.ndarray) -> np.ndarray:
        """The space (3, 3) that patterns lie in, of the linear part of `to_world`."""
        return linear

    def sample_direction(
        self, it: mi.Interaction3f, sample: mi.Point2f, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        """See `mi.Emitter`."""
        direction = self.towards(it.p, sample)
        found = self.crossing(it.p, direction)
        lit = found.hit & active
        # a shadow ray to a point so far away loses nothing but the last digit of its direction
        return self._sampled(it, direction, dr.minimum(found.distance, 1e6), found, lit)

    def _sampled(
        self, it: mi.Interaction3f, direction: mi.Vector3f, distance: mi.Float, found: Crossing, lit: Any
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        ds = dr.zeros(mi.DirectionSample3f)
        ds.d, ds.dist, ds.p, ds.n = direction, distance, it.p + distance * direction, -direction
        ds.time, ds.delta = it.time, True
        ds.pdf = dr.select(lit, found.density, 0)
        ds.emitter = mi.EmitterPtr(self)
        value = self.radiance * (found.factor / dr.maximum(found.density, 1e-30))
        return ds, dr.select(lit & (found.density > 0), value, 0)

    def pdf_direction(self, it: mi.Interaction3f, ds: mi.DirectionSample3f, active: Any = True) -> mi.Float:
        """See `mi.Emitter`."""
        found = self.crossing(it.p, ds.d)
        return dr.select(found.hit & active, found.density, 0)

    def eval_direction(self, it: mi.Interaction3f, ds: mi.DirectionSample3f, active: Any = True) -> mi.Color3f:
        """Radiance that arrives along `ds.d` from nearer than `ds.dist`."""
        found = self.crossing(it.p, ds.d)
        return dr.select(found.hit & active & (found.distance <= ds.dist), self.radiance * found.factor, 0)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> mi.Color3f:
        """Nothing: a lamp is no surface."""
        return mi.Color3f(0)

    def bbox(self) -> mi.ScalarBoundingBox3f:
        """Empty, so that the size of the scene is that of its surfaces."""
        return mi.ScalarBoundingBox3f()

    def to_string(self) -> str:
        """Short description."""
        return f"{type(self).__name__}[radiance={self.radiance}, camera={self.camera}]"


def opaque_color(value: Any) -> mi.Color3f:
    """A colour that is not baked into kernels, so that other lights need no compilation."""
    color = mi.Color3f(value)
    dr.make_opaque(color)
    return color


def matrix_of(props: mi.Properties) -> np.ndarray:
    """`to_world` as (4, 4) numbers."""
    return np.array(props.get("to_world", mi.ScalarTransform4f()).matrix, np.float64)


def opaque_vector(values: np.ndarray) -> mi.Vector3f:
    """A vector that is not baked into kernels."""
    vector = mi.Vector3f(*(float(v) for v in values))
    dr.make_opaque(vector)
    return vector


def cone_direction(axis: mi.Vector3f, less: mi.Float, u: mi.Point2f) -> mi.Vector3f:
    """A direction of the cone around the unit vector `axis` whose half angle has cosine 1 - `less`, uniformly.

    Without 1 - cos, which would lose a lamp of half a degree in rounding.
    """
    drop = less * u.x
    sine = dr.safe_sqrt(drop * (2 - drop))
    s, c = dr.sincos(2 * dr.pi * u.y)
    return dr.normalize(mi.Frame3f(axis).to_world(mi.Vector3f(sine * c, sine * s, 1 - drop)))
