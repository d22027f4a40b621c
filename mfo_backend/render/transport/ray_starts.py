# SPDX-License-Identifier: Apache-2.0
"""Where rays start that leave a surface: a little above it, so that they do not meet it again.

Mitsuba starts them 0.09 mm (1 + d) above, d the distance from zero: beyond a decal that lies closer on its wall, and
inside of a beetle that stands on a shelf. In scenes of Cycles where some surface lets light through, or that have a
small shape, it is `EPSILON` (1 + d). A small shape counts by its own size.

Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .smooth_facets import follows_cycles, shape_table

MITSUBA = 1500.0 * 2.0**-24  # half steps of a float at 1 (mitsuba/core/math.h, RayEpsilon)
# Of two million rays that leave or pass a square, at any angle, none meets it again for sides of 1 m to 200 m, up to
# 100 m from zero, alone and as an instance, and 10 for one of 1 km; with 40 half steps it is 100, and 2,281 for 10 km
EPSILON = 75.0 * 2.0**-24
# A ray to a light ends so many times what it starts above a surface before it, as Mitsuba's: there it is a share of the
# way. With that share alone light of a ball went past a film of 0.5 mm around it: a floor was 0.9 % too bright, and
# that of a lamp which is aslant in a ceiling through it: a room was 1.6 % too bright
BEFORE_LIGHT = 10.0
# Metres: shapes that reach no further from zero are small. Rays start as many steps of a float above them as at 1 m.
# With Mitsuba's a scene of millimetres was 0.83 % darker than in Cycles and one of centimetres 0.12 %; both were within
# 0.02 % (docs/notebook/differential.md). What a large shape shows beside a small one was up to 9 % too dark: a shelf
# below a beetle of 5 mm
SMALL = 0.1


class RayStarts:
    """Of all shapes of a scene; those of instances are left to Mitsuba."""

    def __init__(self, scene: mi.Scene) -> None:
        shapes = list(scene.shapes())
        boxes = [shape.bbox() for shape in shapes]
        reach = [float(np.max(np.abs([np.ravel(box.min), np.ravel(box.max)]))) for box in boxes]
        small = [(shape, far) for shape, far in zip(shapes, reach, strict=True) if 0.0 < far <= SMALL]
        # where all is opaque and large nothing shows what lies so near
        is_near = (bool(small) and follows_cycles(scene)) or lets_through(scene, mi.BSDFFlags.Transmission)
        self._epsilon = EPSILON if is_near else MITSUBA
        self._end = EPSILON if follows_cycles(scene) else MITSUBA
        self._reach = shape_table(*map(list, zip(*small, strict=True)), mi.Float) if small else None

    def ray(self, si: mi.SurfaceInteraction3f, direction: mi.Vector3f) -> mi.Ray3f:
        """As `si.spawn_ray`."""
        return mi.Ray3f(self._start(si, mi.Point3f(si.p), direction), direction, dr.inf, si.time, si.wavelengths)

    def ray_to(self, si: mi.SurfaceInteraction3f, end: mi.Point3f, lift: Any = 0.0) -> mi.Ray3f:
        """As `si.spawn_ray_to`, from a point `lift` away from `si`."""
        point = mi.Point3f(si.p + lift)
        start = self._start(si, point, end - point)
        way = end - start
        far = dr.norm(way)
        near = self._end * (1.0 + dr.maximum(dr.max(dr.abs(end)), far))
        before = BEFORE_LIGHT * dr.minimum(MITSUBA * far, near)
        return mi.Ray3f(start, way / far, far - before, si.time, si.wavelengths)

    def _start(self, si: mi.SurfaceInteraction3f, point: mi.Point3f, direction: mi.Vector3f) -> mi.Point3f:
        size = 1.0 + dr.max(dr.abs(point))
        if self._reach is not None:
            number = dr.reinterpret_array(mi.UInt32, si.shape)
            known = number < dr.opaque(mi.UInt32, dr.width(self._reach))
            reach = dr.gather(mi.Float, self._reach, number, known)
            size = dr.select(reach > 0.0, reach, size)
        return point + mi.Vector3f(si.n) * dr.mulsign(self._epsilon * size, dr.dot(si.n, direction))


def lets_through(scene: mi.Scene, flags: mi.BSDFFlags | int) -> bool:
    """Whether light goes through a surface by some lobes, in a scene whose pictures are to be as Cycles makes them."""
    return follows_cycles(scene) and any(
        s.bsdf() is not None and mi.has_flag(s.bsdf().flags(), flags) for s in scene.shapes()
    )
