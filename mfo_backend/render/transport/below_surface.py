# SPDX-License-Identifier: Apache-2.0
"""What cameras see of light that has travelled below a surface, for pictures by path tracers that know none.

Behind the first hit of a camera ray a Lambert lobe stands for it. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ...types.light_paths import LightPaths
from .camera_view import CameraView
from .exit_light import light_from_below
from .shadow_rays import ShadowRays
from .smooth_facets import seen_side
from .subsurface_walks import materials_with_below


def seen_from_below(
    scene: mi.Scene, ray: mi.Ray3f, sampler: mi.Sampler, light_paths: LightPaths | None, depth: int
) -> mi.Color3f:
    """Radiance along camera rays that has left the first surface from below, scene-linear.

    The first is the one at which a ray ends that cut-outs let through.
    """
    materials = materials_with_below(scene)
    if not materials:
        return mi.Color3f(0)
    shadows = ShadowRays(scene)
    if shadows.lets_through:
        si, left = _behind_cut_outs(scene, CameraView(scene), shadows, sampler, mi.Ray3f(ray), mi.Bool(True))
        return left * light_from_below(scene, materials, si, dr.max(left) > 0.0, sampler, light_paths, depth)
    met = CameraView(scene).met(ray)
    si = seen_side(scene, met.compute_surface_interaction(ray, mi.RayFlags.All, met.is_valid()))
    return light_from_below(scene, materials, si, si.is_valid(), sampler, light_paths, depth)


@dr.syntax
def _behind_cut_outs(
    scene: mi.Scene, view: CameraView, shadows: ShadowRays, sampler: mi.Sampler, ray: mi.Ray3f, active: mi.Bool
) -> tuple[mi.SurfaceInteraction3f, mi.Color3f]:
    """The surface at which a camera ray ends, by chance where one lets part of it through, and what is left of its
    light over the chance of that."""
    absorption, passages, left = shadows.absorption, mi.UInt32(0), mi.Color3f(1)
    inside, ends = absorption.outside(), dr.zeros(mi.SurfaceInteraction3f, dr.width(ray))
    while dr.hint(active, label="cut-outs before a walk"):
        si = view.met(ray, active).compute_surface_interaction(ray, mi.RayFlags.All, active)
        last = mi.Bool(shadows.ends(si, passages))
        si = seen_side(scene, si)
        left *= dr.select(active, absorption.left(absorption.lengths(inside, si.t)), 1)
        clear = mi.Color3f(si.bsdf().eval_null_transmission(si, active))
        chance = dr.clip(dr.max(clear), 0.0, 1.0)
        goes_on = active & si.is_valid() & ~last & (sampler.next_1d() < chance)
        shown = dr.select(si.is_valid() & ~last, dr.rcp(dr.maximum(1 - chance, 1e-6)), 0)
        left *= dr.select(active, dr.select(goes_on, clear / dr.maximum(chance, 1e-6), shown), 1)
        ends = dr.select(active, si, ends)
        onward = shadows.starts.ray(si, ray.d)
        onward.maxt = ray.maxt - si.t  # the camera's far clipping holds on
        inside = absorption.crossed(inside, si, goes_on)
        passages[goes_on] += 1
        ray = dr.select(goes_on, onward, ray)
        active = goes_on
    return ends, left


class WithBelow:
    """As much of an integrator in Python as pictures use: `cycles_path` with what comes from below."""

    def __init__(self, integrator: Any, light_paths: LightPaths) -> None:
        self._integrator, self._light_paths = integrator, light_paths
        self.prepare, self.sample_rays = integrator.prepare, integrator.sample_rays

    def sample(self, *, scene: mi.Scene, sampler: mi.Sampler, ray: Any, **others: Any) -> tuple[Any, ...]:
        """Radiance along camera rays, and whether they meet anything."""
        ray = mi.Ray3f(ray)
        light, *rest = self._integrator.sample(scene=scene, sampler=sampler, ray=ray, walked=True, **others)
        return light + seen_from_below(scene, ray, sampler, self._light_paths, self._integrator.max_depth), *rest
