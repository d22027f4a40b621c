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

from ...material.principled.random_walk import WALK
from ...types.light_paths import LightPaths
from .camera_view import CameraView
from .exit_light import exit_light
from .path_random import PathRandom
from .smooth_facets import seen_side
from .subsurface_walks import walked


def materials_with_below(scene: mi.Scene) -> list[Any]:
    """The materials of a scene that let light walk below their surface."""
    found = {id(bsdf): bsdf for bsdf in (shape.bsdf() for shape in scene.shapes()) if getattr(bsdf, "has_below", False)}
    return list(found.values())


def light_from_below(
    scene: mi.Scene, ray: mi.Ray3f, sampler: mi.Sampler, light_paths: LightPaths | None, depth: int
) -> mi.Color3f:
    """Radiance along camera rays that has left the first surface from below, one walk for each; scene-linear."""
    materials, count = materials_with_below(scene), dr.width(ray.o)
    total = dr.zeros(mi.Color3f, count)
    if not materials:
        return total
    met = CameraView(scene).met(ray)
    si = seen_side(met.compute_surface_interaction(ray, mi.RayFlags.All, met.is_valid()))
    seed = mi.UInt32(sampler.next_1d() * 2.0**24)
    dr.eval(si, seed)
    for material in materials:
        lane = dr.compress(si.is_valid() & (si.bsdf() == mi.BSDFPtr(material)))
        if dr.width(lane) == 0:
            continue
        entered = dr.gather(mi.SurfaceInteraction3f, si, lane)
        below = material.below(entered, mi.Bool(True))
        entered.sh_frame.n = dr.mulsign(entered.sh_frame.n, entered.wi.z)
        entered.wi.z = dr.abs(entered.wi.z)
        random = PathRandom.of(lane, dr.gather(mi.UInt32, seed, lane))
        walks = walked(scene, entered, below, random, dr.max(below.weight) > 0.0)
        shown = below.shown(entered.wi, dict(zip(WALK.names, walks.held, strict=True)))
        out = dr.compress(walks.out)
        if dr.width(out) == 0:
            continue
        others = mi.load_dict({"type": "independent", "sample_count": 1})
        others.seed(dr.gather(mi.UInt32, seed, 0), dr.width(out))
        light = exit_light(scene, dr.gather(mi.SurfaceInteraction3f, walks.si, out), others, light_paths, depth)
        light *= dr.gather(mi.Color3f, shown, out)
        dr.scatter(total, light, dr.gather(mi.UInt32, lane, out), mode=dr.ReduceMode.Permute)
    dr.eval(total)
    return total


class WithBelow:
    """As much of an integrator in Python as pictures use: `cycles_path` with what comes from below."""

    def __init__(self, integrator: Any, light_paths: LightPaths) -> None:
        self._integrator, self._light_paths = integrator, light_paths
        self.prepare, self.sample_rays = integrator.prepare, integrator.sample_rays

    def sample(self, *, scene: mi.Scene, sampler: mi.Sampler, ray: Any, **others: Any) -> tuple[Any, ...]:
        """Radiance along camera rays, and whether they meet anything."""
        ray = mi.Ray3f(ray)
        light, *rest = self._integrator.sample(scene=scene, sampler=sampler, ray=ray, walked=True, **others)
        depth = self._integrator.max_depth
        return light + light_from_below(scene, ray, sampler, self._light_paths, depth), *rest
