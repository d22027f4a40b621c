# SPDX-License-Identifier: Apache-2.0
"""Where camera rays end: on the target, behind the holes that it is cut out by, or beside it.

A ray that meets the target where its alpha is below 1 goes on by the chance of what is left, as in a path tracer. What
it ends on then counts whole. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...types.light_paths import NO_LIMIT
from ..random_numbers.even_points import even_points
from ..transport.camera_view import CameraView
from ..transport.ray_starts import RayStarts
from .primary_rays import PrimaryRays


@dataclass(frozen=True)
class FirstHits:
    """What each of the rays ends on, at distances from the camera, and whether it is the target.

    `gone` is how far a ray went to the last hole of the target that it passed, 0 where it passed none; None without
    holes. `lost` are those that met a surface behind as many holes as a ray may pass: Cycles shows none of it.
    """

    met: mi.PreliminaryIntersection3f
    on_target: mi.Bool
    gone: mi.Float | None = None
    lost: Any = None

    def onward(self, ray: mi.Ray3f, number: mi.UInt32) -> mi.Ray3f:
        """The rays of these numbers from behind the holes that they passed."""
        if self.gone is None:
            return ray
        gone = dr.gather(mi.Float, self.gone, number)
        onward = mi.Ray3f(ray)
        onward.o = ray.o + gone * ray.d
        onward.maxt = ray.maxt - gone
        return onward


def first_hits(scene: mi.Scene, shape: mi.Shape, rays: PrimaryRays, *, cut_out: bool, seed: int) -> FirstHits:
    """Where the rays end; only a target that is `cut_out` by a fixed alpha lets some pass."""
    number = dr.arange(mi.UInt32, len(rays))
    ray, view = rays.ray(number), CameraView(scene)
    target = mi.ShapePtr(shape)
    dr.make_opaque(target)  # its number in this process is no part of the kernel
    met = view.met(ray)
    on_target = met.is_valid() & (met.shape == target)
    if not cut_out:
        return FirstHits(met, on_target)
    (chance,) = even_points(1, number, rays.position(number), len(rays.pixel), seed + 0x1B873593)
    most = dr.opaque(mi.UInt32, int(getattr(scene.integrator(), "transparent_bounces", NO_LIMIT)))
    return FirstHits(*_beyond(view, RayStarts(scene), shape.bsdf(), target, ray, met, on_target, chance, most))


@dr.syntax
def _beyond(
    view: CameraView,
    starts: RayStarts,
    bsdf: Any,
    target: mi.ShapePtr,
    ray: mi.Ray3f,
    met: mi.PreliminaryIntersection3f,
    on_target: mi.Bool,
    chance: mi.Float,
    most: mi.UInt32,
) -> tuple[mi.PreliminaryIntersection3f, mi.Bool, mi.Float, mi.Bool]:
    """`FirstHits` of rays that begin with what they have `met`; a `chance` is used up by the holes that it passes."""
    ray, start, onto = mi.Ray3f(ray), mi.Point3f(ray.o), mi.Bool(on_target)
    gone, passed, lost = dr.zeros(mi.Float, dr.width(chance)), mi.UInt32(0), mi.Bool(False)
    active = mi.Bool(on_target)
    while dr.hint(active, label="holes of the target"):
        si = met.compute_surface_interaction(ray, mi.RayFlags.All, active)
        clear = dr.mean(bsdf.eval_null_transmission(si, active))
        active &= chance < clear
        chance = dr.select(active, chance / dr.maximum(clear, 1e-12), chance)
        passed[active] += 1
        onward = starts.ray(si, ray.d)
        onward.maxt = ray.maxt - si.t
        ray = dr.select(active, onward, ray)
        gone = dr.select(active, dr.dot(onward.o - start, ray.d), gone)
        met = dr.select(active, view.met(ray, active), met)
        lost |= active & met.is_valid() & (passed >= most)
        onto = dr.select(active, met.is_valid() & (met.shape == target) & ~lost, onto)
        active &= onto
    met.t += gone
    return met, onto, gone, lost
