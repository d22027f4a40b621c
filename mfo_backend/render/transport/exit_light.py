# SPDX-License-Identifier: Apache-2.0
"""Light that white matte surfaces send on: what walks below a surface meet where they leave it.

Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory
from ...types.light_paths import LightPaths
from ..lamps.met_lamps import DELTA, SceneLamps
from .shadow_rays import ShadowRays
from .smooth_facets import leaves_on, met_light
from .traced_radiance import traced_radiance


def exit_light(
    scene: mi.Scene, si: mi.SurfaceInteraction3f, sampler: mi.Sampler, light_paths: LightPaths | None, depth: int
) -> mi.Color3f:
    """Radiance that Lambert's lobe of albedo 1 sends to all sides of `si.wi`, over paths of up to `depth`.

    Every light of no extent counts; of the others one is drawn, and one direction of the cosine (Veach 1995).
    """
    lamps, shadows = SceneLamps(scene), ShadowRays(scene)
    emitters = list(scene.emitters())
    extended = [k for k, e in enumerate(emitters) if not mi.has_flag(e.flags(), DELTA)]
    total = mi.Color3f(0)

    def sent(ds: mi.DirectionSample3f, value: mi.Color3f) -> tuple[mi.Color3f, mi.Float]:
        """What is sent on of a light sample, and the density of its direction; 0 where no direction finds it."""
        wo = si.to_local(ds.d)
        lit = (ds.pdf > 0.0) & (wo.z > 0.0) & (dr.max(value) > 0.0)
        likely = mi.warp.square_to_cosine_hemisphere_pdf(wo)
        passed = shadows.passed(si, ds, lit)
        value = value * passed.through * (likely * shadows.terminator.bend(si, wo, lit))
        # what comes straight through a surface is left to light samples: after `before`, `cycles_path` adds none of it
        return dr.select(lit, value, 0.0), dr.select(passed.alpha, 0.0, likely)

    for emitter in emitters:
        if mi.has_flag(emitter.flags(), DELTA):
            total += sent(*emitter.sample_direction(si, mi.Point2f(0.5)))[0]
    chance = 1.0 / max(len(extended), 1)
    if extended:
        pick = dr.minimum(mi.UInt32(sampler.next_1d() * len(extended)), len(extended) - 1)
        number = dr.gather(mi.UInt32, own_memory(np.array(extended), mi.UInt32), pick)
        emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), number)
        ds, value = emitter.sample_direction(si, sampler.next_2d())
        value, likely = sent(ds, value)
        total += value / (chance + likely / dr.maximum(ds.pdf, 1e-30))

    wo = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
    likely = mi.warp.square_to_cosine_hemisphere_pdf(wo)
    valid = (likely > 0.0) & leaves_on(si, wo, False)
    ray = si.spawn_ray(si.to_world(wo))
    met = scene.ray_intersect_preliminary(ray, active=valid)
    far = met.compute_surface_interaction(ray, mi.RayFlags.All, valid)
    emitter = far.emitter(scene, valid)
    emission = emitter.eval(far, valid)
    density = emitter.pdf_direction(si, met_light(scene, far, si), valid & (dr.max(emission) > 0.0)) * chance
    seen = emission * (likely / (likely + density))
    if lamps:
        seen += lamps.met(ray, far, valid, density=likely, chance=chance)
    if depth > 2:
        before = (likely, mi.Color3f(1.0))
        seen += traced_radiance(scene, sampler, ray, light_paths, depth - 1, before=before, met=met)
    total += dr.select(valid, seen * shadows.terminator.bend(si, wo, valid), 0.0)
    return dr.select(dr.all(dr.isfinite(total)), total, 0.0)
