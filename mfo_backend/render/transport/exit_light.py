# SPDX-License-Identifier: Apache-2.0
"""Light from below surfaces: random walks, and the light that they meet where they leave.

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

from ...material.arrays.own_memory import own_memory
from ...material.principled.bumped_normals import BumpedNormals
from ...material.principled.random_walk import WALK
from ...types.light_paths import LightPaths
from ..lamps.met_lamps import DELTA, SceneLamps
from ..random_numbers.path_random import PathRandom
from .shadow_rays import ShadowRays
from .smooth_facets import leaves_on, met_light, seen_side
from .subsurface_walks import materials_with_below, walked
from .traced_radiance import traced_radiance

# Walks of one path in all; a Lambert lobe stands for what a further one would bring. With one, Suzanne of wax is 1 %
# too dark, with three 0.2 % (docs/notebook/subsurface.md)
MOST_WALKS = 3


def light_from_below(
    scene: mi.Scene,
    materials: list[Any],
    si: mi.SurfaceInteraction3f,
    active: mi.Bool,
    sampler: mi.Sampler,
    light_paths: LightPaths | None,
    depth: int,
    walks: int = 1,
) -> mi.Color3f:
    """Radiance towards `si.wi` that leaves from below surfaces of these `materials`, one walk for each hit.

    It is the number `walks` of its path. Paths are of up to `depth`.
    """
    total = dr.zeros(mi.Color3f, dr.width(si.p))
    seed = mi.UInt32(sampler.next_1d() * 2.0**24)
    dr.eval(si, active, seed)
    for material in materials:
        lane = dr.compress(active & si.is_valid() & (si.bsdf() == mi.BSDFPtr(material)))
        if dr.width(lane) == 0:
            continue
        entered = dr.gather(mi.SurfaceInteraction3f, si, lane)
        below = material.below(entered, mi.Bool(True))
        if material.walked.bumped:
            entered.sh_frame, entered.wi, _ = material.walked.bumped_frame(entered, mi.Bool(True))
        entered.sh_frame.n = dr.mulsign(entered.sh_frame.n, entered.wi.z)
        entered.wi.z = dr.abs(entered.wi.z)
        random = PathRandom.of(lane, dr.gather(mi.UInt32, seed, lane) + walks)
        found = walked(scene, entered, below, random, dr.max(below.weight) > 0.0)
        shown = below.shown(entered.wi, dict(zip(WALK.names, found.held, strict=True)))
        out = dr.compress(found.out)
        if dr.width(out) == 0:
            continue
        others = mi.load_dict({"type": "independent", "sample_count": 1})
        others.seed(dr.gather(mi.UInt32, seed, 0) + walks, dr.width(out))
        exits = dr.gather(mi.SurfaceInteraction3f, found.si, out)
        light = dr.gather(mi.Color3f, shown, out) * exit_light(scene, exits, others, light_paths, depth, walks)
        dr.scatter(total, light, dr.gather(mi.UInt32, lane, out), mode=dr.ReduceMode.Permute)
    dr.eval(total)
    return total


class _Bumps:
    """What bumps beside those where light leaves keep from it, where nodes give normals."""

    def __init__(self, of_lanes: list[tuple[mi.Bool, BumpedNormals]]) -> None:
        self._of = of_lanes

    def left(self, direction: mi.Vector3f) -> mi.Float:
        """The share that is left of light from a direction of the world."""
        share = mi.Float(1)
        for here, normals in self._of:
            left = dr.select(normals.lit(normals.diffuse, direction), normals.terminator(direction), 0.0)
            share = dr.select(here, left, share)
        return share


def _lit_by_bumps(scene: mi.Scene, si: mi.SurfaceInteraction3f) -> tuple[mi.SurfaceInteraction3f, _Bumps]:
    """The places where walks leave with the normals that nodes give there (kernel/integrator/subsurface.h)."""
    of_lanes, leaving, towards = [], mi.SurfaceInteraction3f(si), si.to_world(si.wi)
    for material in materials_with_below(scene):
        here = si.is_valid() & (si.bsdf() == mi.BSDFPtr(material))
        normals = material.walked.leaving(si, here)
        if normals is not None:
            of_lanes.append((here, normals))
            leaving.sh_frame = dr.select(here, mi.Frame3f(normals.diffuse), leaving.sh_frame)
    leaving.wi = leaving.to_local(towards)
    return leaving, _Bumps(of_lanes)


def exit_light(
    scene: mi.Scene,
    si: mi.SurfaceInteraction3f,
    sampler: mi.Sampler,
    light_paths: LightPaths | None,
    depth: int,
    walks: int = 1,
) -> mi.Color3f:
    """Radiance that Lambert's lobe of albedo 1 sends to all sides of `si.wi`, over paths of up to `depth`.

    Every light of no extent counts; of the others one is drawn, and one direction of the cosine (Veach 1995). So many
    `walks` have led there.
    """
    lamps, shadows = SceneLamps(scene), ShadowRays(scene)
    emitters = list(scene.emitters())
    extended = [k for k, e in enumerate(emitters) if not mi.has_flag(e.flags(), DELTA)]
    total = mi.Color3f(0)
    si, bumps = _lit_by_bumps(scene, si)

    def sent(ds: mi.DirectionSample3f, value: mi.Color3f) -> tuple[mi.Color3f, mi.Float]:
        """What is sent on of a light sample, and the density of its direction; 0 where no direction finds it."""
        wo = si.to_local(ds.d)
        lit = (ds.pdf > 0.0) & (wo.z > 0.0) & (dr.max(value) > 0.0)
        likely = mi.warp.square_to_cosine_hemisphere_pdf(wo)
        passed = shadows.passed(si, ds, lit)
        value = value * shadows.left(passed) * (likely * shadows.terminator.bend(si, wo, lit) * bumps.left(ds.d))
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
    valid = (likely > 0.0) & leaves_on(scene, si, wo, False)
    ray = shadows.starts.ray(si, si.to_world(wo))
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
        again = [m for m in materials_with_below(scene) if m.model.walks_again] if walks < MOST_WALKS else []
        further = {"before": before, "met": met, "walked": bool(again)}
        seen += traced_radiance(scene, sampler, ray, light_paths, depth - 1, **further)
        if again:
            far = seen_side(scene, far)
            seen += light_from_below(scene, again, far, valid, sampler, light_paths, depth - 1, walks + 1)
    seen *= shadows.terminator.bend(si, wo, valid) * bumps.left(si.to_world(wo))
    total += dr.select(valid, seen, 0.0)
    return dr.select(dr.all(dr.isfinite(total)), total, 0.0)
