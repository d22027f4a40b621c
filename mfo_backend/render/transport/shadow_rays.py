# SPDX-License-Identifier: Apache-2.0
"""How much of a lamp's light reaches a point, as Cycles' shadow rays say (kernel/integrator/shade_shadow.h).

A shadow ray goes on through surfaces that are cut out by alpha, and loses what they do not let through. It sees no
obstacle on the way to a lamp that casts no shadows (its property `shadow`), and a shape whose attribute
`SHADOW_TRANSMISSION` is 1 is none; where that is 0 the shape blocks light whatever its alpha. Rays that a material has
sent out see all of these as they are, and so does the light of a uniform world, to which Cycles sends no shadow rays
(scene/light.cpp, `test_enabled_lights`). Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory
from ...material.plugins.ray_kinds import SCATTERED, SHADOW, is_by_ray
from .absorption import Absorption, Inside
from .ray_starts import RayStarts, lets_through
from .smooth_facets import TRANSMITS, ShadowTerminator, leaves_on, shape_number, shape_table

SHADOW_TRANSMISSION = "shadow_transmission"
UNIFORM = "ConstantBackgroundEmitter"  # Mitsuba's class of the plugin `constant`


@dataclass(frozen=True)
class Passed:
    """What surfaces leave of light: its share `through` (RGB), whether `alpha` took some, and how often it went through
    the surface `of` which was asked. Its `lengths` are those inside of each absorbing material."""

    through: Any
    alpha: Any
    times: Any
    lengths: Any


class ShadowRays:
    """The shadow rays of a scene."""

    def __init__(self, scene: mi.Scene) -> None:
        self.terminator, self.starts = ShadowTerminator.of(scene), RayStarts(scene)
        self._scene, self.absorption = scene, Absorption(scene)
        self._shadowless = [e for e in scene.emitters() if not getattr(e, "shadow", True)]
        self._uniform = [e for e in scene.emitters() if e.class_name() == UNIFORM]
        self._marked = marked = [s for s in scene.shapes() if np.any(s.has_attribute(SHADOW_TRANSMISSION))]
        # of each shape: 1 more than what it lets through, or 0 where its material says it
        values = [1.0 + shape_number(s, SHADOW_TRANSMISSION) for s in marked]
        self._marks = shape_table(marked, values, mi.Float) if marked else own_memory(np.zeros(1, np.float32), mi.Float)
        # surfaces that light goes straight through; Mitsuba's integrators block all light
        self.most = int(getattr(scene.integrator(), "transparent_bounces", 0))
        self.lets_through = lets_through(scene, mi.BSDFFlags.Null)
        self.by_ray = is_by_ray(scene)

    def passed(
        self,
        si: mi.SurfaceInteraction3f,
        ds: mi.DirectionSample3f,
        active: Any,
        of: Any = None,
        passages: mi.UInt32 | int = 0,
        inside: Inside | None = None,
    ) -> Passed:
        """What is left of the light of the sample `ds` at `si`; passages through the BSDF `of` are only counted.

        The path to `si` has made as many `passages` itself, and is `inside` of so many objects, of none without it.
        """
        casts = mi.Bool(active)
        for lamp in self._shadowless:
            casts &= ds.emitter != mi.EmitterPtr(lamp)
        # light that Cycles leaves to directions of materials: none starts above its facet, or leaves it backwards
        drawn = is_unsampled(ds)
        lost = drawn & ~leaves_on(self._scene, si, si.to_local(ds.d), _crosses(si, ds))
        ray = self.starts.ray_to(si, ds.p, self.terminator.lift(si, ds.d, casts & ~drawn))
        begin = self.absorption.outside() if inside is None else inside
        begin = self.absorption.beyond(begin, si, si.to_local(ds.d), casts)
        if not self._marked and not self.lets_through:
            hidden = lost | self._scene.ray_test(ray, casts & ~lost)
            lengths = self.absorption.lengths(begin, ds.dist)
            return Passed(dr.select(hidden, mi.Color3f(0), 1), mi.Bool(False), mi.UInt32(0), lengths)
        made, limit = mi.UInt32(passages), dr.opaque(mi.UInt32, self.most)
        most = dr.select(limit > made, limit - made, 0)
        asked = mi.Bool(True)
        for world in self._uniform:
            asked &= ds.emitter != mi.EmitterPtr(world)
        passed = self._followed(mi.Ray3f(ray), mi.Point3f(ds.p), casts & ~lost, mi.BSDFPtr(of), most, asked, begin)
        return replace(passed, through=dr.select(lost, 0, passed.through))

    def left(self, passed: Passed) -> mi.Color3f:
        """The share of light (RGB) that surfaces and volumes leave."""
        return passed.through * self.absorption.left(passed.lengths) if self.absorption else passed.through

    def ends(self, si: mi.SurfaceInteraction3f, passages: mi.UInt32) -> mi.Bool | bool:
        """Whether a path that has gone straight through as many surfaces as it may has met a further one.

        As in Cycles that one still shows its own light, and sends none on.
        """
        if not self.lets_through:
            return False
        return si.is_valid() & (passages > 0) & (passages >= dr.opaque(mi.UInt32, self.most))

    @dr.syntax
    def _followed(
        self,
        ray: mi.Ray3f,
        end: mi.Point3f,
        active: mi.Bool,
        of: mi.BSDFPtr,
        most: mi.UInt32,
        asked: mi.Bool,
        inside: Inside,
    ) -> Passed:
        """What is left behind all surfaces on a ray; they are `asked` for marks or are as materials say."""
        scene, marks, absorption = self._scene, self._marks, self.absorption
        inside, lengths = list(inside), absorption.lengths(inside, mi.Float(0))
        through, alpha, times, met = mi.Color3f(1), mi.Bool(False), mi.UInt32(0), mi.UInt32(0)
        while dr.hint(active, label="shadow rays"):
            si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
            segment = dr.select(active, dr.select(si.is_valid(), si.t, ray.maxt), 0)
            lengths = absorption.further(lengths, inside, segment)
            active &= si.is_valid()
            if self.by_ray:
                # what Cycles leaves to directions of materials is met as these are, of which most are diffuse
                si.duv_dy = mi.Point2f(0, dr.select(asked, SHADOW, SCATTERED))
            bsdf = si.bsdf()
            share = mi.Color3f(bsdf.eval_null_transmission(si, active))
            own = active & (bsdf == of)
            number = dr.reinterpret_array(mi.UInt32, si.shape)
            known = active & asked & (number < dr.opaque(mi.UInt32, dr.width(marks)))
            mark = dr.gather(mi.Float, marks, number, known)
            marked = known & (mark > 0)
            own &= ~marked
            alpha |= active & ~marked & (dr.max(share) > 0)
            share = dr.select(marked, mi.Color3f(mark - 1), dr.select(own, 1, share))
            met[active & ~marked] += 1
            times[own] += 1
            share = dr.select(met > most, 0, share)
            through = dr.select(active, through * share, through)
            active &= dr.max(through) > 0
            inside = absorption.crossed(inside, si, active & ~marked)
            ray = self.starts.ray_to(si, end)
        return Passed(through, alpha, times, lengths)


def sample_light(
    scene: mi.Scene,
    shadows: ShadowRays,
    si: mi.SurfaceInteraction3f,
    u: mi.Point2f,
    active: mi.Bool,
    of: Any = None,
    passages: mi.UInt32 | int = 0,
    inside: Inside | None = None,
) -> tuple[mi.DirectionSample3f, mi.Color3f, mi.UInt32, list[mi.Float]]:
    """As `scene.sample_emitter_direction` with its test for obstacles, as Cycles tests for them.

    Further how often the light went through the BSDF `of`, and how far inside of each absorbing material; both take
    nothing of it here. What `inside` means is said at `passed`.
    """
    ds, light = scene.sample_emitter_direction(si, u, False, active)
    passed = shadows.passed(si, ds, active & (ds.pdf > 0.0), of, passages, inside)
    ds.pdf = dr.select(dr.max(passed.through) > 0, ds.pdf, 0.0)
    return ds, light * passed.through, passed.times, passed.lengths


def is_unsampled(ds: mi.DirectionSample3f) -> mi.Bool:
    """Whether light is that of a uniform world, which Cycles leaves to the directions that materials draw."""
    flags = ds.emitter.flags()
    varies = mi.has_flag(flags, mi.EmitterFlags.SpatiallyVarying)
    return mi.has_flag(flags, mi.EmitterFlags.Infinite) & ~varies & ~ds.delta


def _crosses(si: mi.SurfaceInteraction3f, ds: mi.DirectionSample3f) -> mi.Bool:
    """Whether light of a sample comes through a material to where it is seen from."""
    lets = (si.bsdf().flags() & TRANSMITS) != 0
    return lets & (si.wi.z * si.to_local(ds.d).z < 0.0)


def left_of(alpha: mi.Float | None, times: mi.UInt32) -> tuple[mi.Float | float, mi.Float | float]:
    """What a surface leaves of light that goes through it so many times, and the derivative by its alpha.

    All of it, and 0, where no alpha is known.
    """
    if alpha is None:
        return 1.0, 0.0
    base, power = dr.maximum(1.0 - alpha, 1e-6), mi.Float(times)
    clear, before = (dr.select(power > less, dr.power(base, power - less), 1.0) for less in (0.0, 1.0))
    return clear, -power * before
