# SPDX-License-Identifier: Apache-2.0
"""Trace a scene once and keep what a change of the target's material cannot alter."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory
from ...material.principled.random_walk import WALK, Below
from ...types.errors import BadInputError
from ...types.light_paths import LightPaths
from ..camera.first_hits import first_hits
from ..camera.highlight_cells import highlight_cells
from ..camera.pixel_cells import PixelCells
from ..camera.primary_rays import TILE, PrimaryRays, fresh_sampler, tile_order
from ..camera.target_hits import TargetHits, facing, other_normals, turned, without_parametrisation
from ..lamps.met_lamps import DELTA, SceneLamps, lights_have_no_extent
from ..random_numbers.even_points import even_points
from ..transport.ray_starts import RayStarts
from ..transport.shadow_rays import ShadowRays
from ..transport.smooth_facets import leaves_on, met_light
from ..transport.traced_radiance import SentOn, sent_on, tells_rays
from .merged_lanes import TechniqueLanes, coverage_of, merged_lanes, summed
from .record_settings import RecordSettings
from .recorded_background import add_radiance, recorded_background
from .recorded_paths import RecordedPaths
from .walked_lanes import WalkSettings, walked_lanes


def record_paths(
    scene: mi.Scene, shape: mi.Shape, settings: RecordSettings, *, allow_dark: bool = False
) -> RecordedPaths:
    """Record the light that reaches the first hit on `shape` from the scene's sensor.

    Raises
    ------
    BadInputError
        If no pixel sees the shape, or no light reaches it (unless `allow_dark`).
    """
    with dr.suspend_grad():
        lamps, shadows = SceneLamps(scene), ShadowRays(scene)
        if lamps and settings.light_paths is None:
            # so that paths over other surfaces know they are no camera's
            settings = replace(settings, light_paths=LightPaths())
        sensor = settings.sensor or scene.sensors()[0]
        width, height = (int(v) for v in sensor.film().crop_size())
        rays = _camera_rays(scene, shape, settings, width, height)
        ends = first_hits(scene, shape, rays, cut_out=settings.cut_out, seed=settings.seed)
        dr.eval(ends.met, ends.on_target, ends.gone, ends.lost)
        index = dr.compress(ends.on_target)
        if dr.width(index) == 0:
            raise BadInputError("No pixel sees the target: check the camera and that the object is not hidden.")
        position, filter_weight, ray = rays.position(index), rays.weight(index), rays.ray(index)
        si = dr.gather(mi.PreliminaryIntersection3f, ends.met, index).compute_surface_interaction(ray, mi.RayFlags.All)
        share = filter_weight
        if settings.cut_out and settings.mixed:  # its shaders have their shares, holes included
            share = share / dr.maximum(1.0 - dr.mean(shape.bsdf().eval_null_transmission(si)), 1e-6)
        glow = si.emitter(scene).eval(si) * share if shape.is_emitter() and not settings.glows else None
        radiance = shape.emitter().unlayered(si) * share if settings.glows else None
        glow = shape.bsdf().held_emission(si) * radiance if radiance is not None and settings.mixed else glow
        if lamps.seen:
            before = lamps.met(ray, si, mi.Bool(True), camera=True) * filter_weight
            glow = before if glow is None else glow + before
        si = facing(scene, shape, si, two_sided=settings.two_sided)
        held = ()
        if settings.held:
            plugin: Any = shape.bsdf()
            values = plugin.values_at(si, mi.Bool(True))
            if settings.bumped:
                values |= plugin.directions_at(si, mi.Bool(True))
            if settings.surface is not None:
                values["subpixel"] = settings.surface.row_of(si.p)
            held = tuple(values[name] + dr.zeros(type(values[name]), dr.width(index)) for name in settings.held)
        below = shape.bsdf().below(si, mi.Bool(True)) if settings.walks else None
        walks_free = below is not None and not (settings.mixed and shape.bsdf().walks_are_held)
        of_hits = held
        if walks_free:
            held += (dr.zeros(mi.Float, dr.width(index)),) * len(WALK)
        own = mi.SurfaceInteraction3f(si) if settings.mixed else None
        if own is not None and below is not None and not walks_free:
            own.duv_dx = mi.Point2f(0.0, 1.0)  # walks take the place of the lobe that stands for them
        normals = other_normals(
            shape, si, bumped=settings.bumped, coat=settings.proposal.coat_roughness is not None, smooth=settings.mixed
        )
        si = turned(shape, si, bumped=settings.bumped)
        sampled = settings.depth > 2 or not lights_have_no_extent(scene)
        if settings.depth == 2 or settings.light_paths is None:
            si = without_parametrisation(si, own_normal=settings.bumped)
        # exact lights alone look at hits once each, and compute them again instead of keeping them
        dr.eval(si if sampled or settings.mixed else (), own, *normals, position, filter_weight, share, held)
        plugin = shape.bsdf() if settings.mixed else None
        hits = TargetHits(si, position, share, held, len(rays.pixel), plugin, own, *normals, settings.proposal.through)
        exact = [part for part in _delta_lights(scene, hits, shadows) if dr.width(part.position) > 0]
        if radiance is not None:
            nowhere = dr.zeros(mi.Vector3f, dr.width(position))
            exact.append(_lit(hits, nowhere, radiance, mi.Bool(True))())
        lanes = [replace(e, position=e.position + s * hits.pixels) for s in range(settings.samples) for e in exact]
        if sampled:
            lanes += _sampled_lights(scene, shape, hits, settings, lamps, shadows)
        if below is not None:
            lanes.append(_walks(scene, hits, of_hits, below, settings, free=walks_free))

        covered, coverage = coverage_of(hits.pixels, position, filter_weight)
        constant = recorded_background(
            scene, (height, width), rays, ends, covered, lamps, seed=settings.seed + 0x2545F49,
            depth=max(settings.depth, 2), light_paths=settings.light_paths, hide_emitters=settings.hide_emitters,
        )  # fmt: skip
        if glow is not None:
            add_radiance(constant, rays.pixel[np.array(position)], glow)
        named = (*settings.held, *(WALK.names if walks_free else ()))
        merged = merged_lanes(lanes, settings.samples, named, rays, covered, coverage, constant)
        if merged.lanes == 0 and not allow_dark:
            raise BadInputError("No light reaches the target: add a light or a world background.")
        return merged


def _camera_rays(scene: mi.Scene, shape: mi.Shape, settings: RecordSettings, width: int, height: int) -> PrimaryRays:
    """Camera rays on the settings' grid, and more of them in narrow highlights if the settings say so."""
    sensor = settings.sensor or scene.sensors()[0]
    order, tile = tile_order(width, height, settings.stride)
    if settings.pixels is not None:
        kept = settings.pixels.reshape(-1)[order]
        order, tile = order[kept], tile[kept]
    per_axis = np.broadcast_to(settings.grid, (height, width)).reshape(-1)[order]
    if settings.highlights is None or not any(mi.has_flag(e.flags(), DELTA) for e in scene.emitters()):
        return PrimaryRays(sensor, PixelCells.grid(per_axis), order, tile, settings.seed)

    def rays_in(cells: PixelCells) -> PrimaryRays:
        return PrimaryRays(sensor, cells, order, tile, settings.seed, four=True)

    def hits_of(rays: PrimaryRays) -> tuple[mi.SurfaceInteraction3f, mi.Bool]:
        ends = first_hits(scene, shape, rays, cut_out=settings.cut_out, seed=settings.seed)
        ray = rays.ray(dr.arange(mi.UInt32, len(rays)))
        si = ends.met.compute_surface_interaction(ray, mi.RayFlags.All, ends.on_target)
        si = facing(scene, shape, si, two_sided=settings.two_sided)
        return turned(shape, si, bumped=settings.bumped), ends.on_target

    cells = PixelCells.grid((per_axis + 1) // 2)
    return rays_in(highlight_cells(scene, cells, rays_in, hits_of, settings.highlights))


def _delta_lights(scene: mi.Scene, hits: TargetHits, shadows: ShadowRays) -> list[TechniqueLanes]:
    """One exact sample for each light of no extent."""
    si = hits.si
    started, terminator = [], shadows.terminator
    for emitter in scene.emitters():
        if not mi.has_flag(emitter.flags(), DELTA):
            continue
        ds, value = emitter.sample_direction(si, mi.Point2f(0.5))
        wo = si.to_local(ds.d)
        lit = (ds.pdf > 0.0) & hits.lit(wo) & (si.wi.z > 0.0) & (dr.max(value) > 0.0)
        value *= shadows.left(shadows.passed(si, ds, lit))
        started.append(_lit(hits, wo, value * (hits.share * terminator.bend(si, wo, lit)), lit & (dr.max(value) > 0.0)))
    return [kept() for kept in started]


def _sampled_lights(
    scene: mi.Scene,
    shape: mi.Shape,
    hits: TargetHits,
    settings: RecordSettings,
    lamps: SceneLamps,
    shadows: ShadowRays,
) -> list[TechniqueLanes]:
    """Light samples and proposal samples of the camera rays, weighted by the balance heuristic (Veach 1995)."""
    extended = [i for i, e in enumerate(scene.emitters()) if not mi.has_flag(e.flags(), DELTA)]
    indirect = settings.depth > 2
    # in one launch: tracing the scene in Python takes longer than to launch it
    count = dr.width(hits.position)
    lane, rays = dr.arange(mi.UInt32, settings.samples * count), dr.opaque(mi.UInt32, count)
    sample = lane // rays
    number = lane - sample * rays
    first, hits = hits, hits.of_rays(number)
    si, share = hits.si, hits.share
    # what has random numbers of its own: pixels and tiles of each sample, or of all if they are alike
    tiles, own = hits.pixels // TILE**2 + 1, sample * dr.opaque(mi.UInt32, 0 if settings.alike else 1)
    pixel = hits.position + own * dr.opaque(mi.UInt32, hits.pixels)
    tile = hits.position // TILE**2 + own * dr.opaque(mi.UInt32, tiles)
    pixels, tiles = hits.pixels * settings.samples, tiles * settings.samples
    hits = replace(hits, position=hits.position + sample * dr.opaque(mi.UInt32, hits.pixels))
    proposal, terminator, front = settings.proposal, shadows.terminator, si.wi.z > 0.0
    # Each extended light is chosen equally often, and that exactly: its share of the rays of a pixel left to chance
    # would be most of the noise, 3 % of a tile for two lights
    choice = 1.0 / max(len(extended), 1)
    started = []
    if extended:
        table = own_memory(np.array(extended), mi.UInt32)
        turns = mi.UInt32(fresh_sampler(settings.seed + 0x3C6EF37, pixels).next_1d() * 65536)
        pick = (number + dr.gather(mi.UInt32, turns, pixel)) % len(extended)
        emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), dr.gather(mi.UInt32, table, pick))
        # one light's samples follow each other in the sequence
        u = even_points(2, number // len(extended), tile, tiles, settings.seed + 0x51ED270)
        ds, value = emitter.sample_direction(si, mi.Point2f(*u), front)
        wo = si.to_local(ds.d)
        lit = front & (ds.pdf > 0.0) & hits.lit(wo) & (dr.max(value) > 0.0)
        # which side light comes from is for the mesh to say, not for a bump
        passed = shadows.passed(si if hits.own is None else hits.own, ds, lit)
        value *= shadows.left(passed)
        lit &= dr.max(value) > 0.0
        light_density = ds.pdf * choice
        mis = light_density / (light_density + proposal.density(si.wi, wo, hits.coat, hits.diffuse))
        # what comes straight through a surface is left to light samples: after `before`, `cycles_path` adds none of it,
        # but where not all rays go through, whose light Cycles' samples leave to them
        straight = mi.Float(1.0)
        if tells_rays(scene, shape.bsdf(), settings.light_paths):
            of_scene = scene.pdf_emitter_direction(si, ds, lit)
            straight = of_scene / (of_scene + si.bsdf().pdf(mi.BSDFContext(), si, wo, lit))
        mis = dr.select(passed.alpha, straight, mis)
        weight = value * (share * mis / choice * terminator.bend(si, wo, lit))
        # none of it returns, and its lanes are merged by the kernel of those where some does
        nothing = weight * dr.opaque(mi.Float, 0.0)
        started.append(_lit(hits, wo, weight, lit, (nothing, nothing) if indirect else None))

    lobe, *u = even_points(3, number, tile, tiles, settings.seed + 0x51ED270)
    wo = proposal.sample(si.wi, lobe, mi.Point2f(*u), hits.coat, hits.diffuse)
    density = proposal.density(si.wi, wo, hits.coat, hits.diffuse)
    valid = front & hits.lit(wo) & (density > 0.0)
    valid &= hits.through or leaves_on(scene, si, wo, False)  # some lobe sends light to either side
    ray = shadows.starts.ray(si, si.to_world(wo))
    met = scene.ray_intersect_preliminary(ray, active=valid)
    far = met.compute_surface_interaction(ray, mi.RayFlags.All, valid)
    emitter = far.emitter(scene, valid)
    emission = emitter.eval(far, valid)
    ds = met_light(scene, far, si)
    light_density = emitter.pdf_direction(si, ds, valid & (dr.max(emission) > 0.0)) * choice
    weight = emission / (light_density + density)
    if lamps:
        weight += lamps.met(ray, far, valid, density=density, chance=choice) / density
    reflected, counted = dr.zeros(mi.Color3f, dr.width(wo)), dr.zeros(mi.Color3f, dr.width(wo))
    if indirect:
        traced = met.is_valid() & (sample >= dr.opaque(mi.UInt32, settings.direct_samples))
        dr.eval(traced, met, wo, weight, reflected, counted, valid)
        index = dr.compress(traced)
        if dr.width(index) > 0:
            some = first.of_rays(index - index // rays * rays)
            met, towards = (dr.gather(type(a), a, index) for a in (met, wo))
            sent = _over_others(scene, shape, shadows.starts, some, met, towards, settings)
            total = dr.gather(mi.Color3f, weight, index) + sent.radiance
            for whole, found in ((weight, total), (reflected, sent.reflected), (counted, sent.counted)):
                dr.scatter(whole, found, index, mode=dr.ReduceMode.Permute)
    # the share may be negative, where the pixel filter is
    share *= terminator.bend(si, wo, valid)
    returned = (reflected * share, counted * share) if indirect else None
    started.append(_lit(hits, wo, weight * share, valid & (dr.max(weight) > 0.0), returned))
    return [kept() for kept in started]


def _walks(
    scene: mi.Scene, hits: TargetHits, held: tuple[Any, ...], below: Below, settings: RecordSettings, *, free: bool
) -> TechniqueLanes:
    """Walks below the surface from all hits, lanes where they are `free`: their light hangs on values that change.

    `held` are values of the hits but for those of walks.
    """
    si, share = hits.si if free else hits.own, hits.share
    if free and hits.plugin is not None and not hits.plugin.is_open:
        share = share * hits.plugin.fitted.weight_at(hits.own)
    begun = TechniqueLanes(si.wi, si.wi, share, hits.position, held)
    depth = max(settings.depth, 2)
    walks = WalkSettings(settings.samples, settings.seed, settings.walks, settings.light_paths, depth, held=not free)
    return walked_lanes(scene, begun, si, below, hits.pixels, walks)


def _over_others(
    scene: mi.Scene,
    shape: mi.Shape,
    starts: RayStarts,
    hits: TargetHits,
    met: mi.PreliminaryIntersection3f,
    wo: mi.Vector3f,
    settings: RecordSettings,
) -> SentOn:
    """Light over the surfaces that rays from the target have `met`, but their own emission, by the rays' density.

    Few rays of most scenes meet something: they are traced on from there side by side.
    """
    si, sampler = hits.si, fresh_sampler(settings.seed + 0x51ED270, dr.width(wo))
    ray = starts.ray(si, si.to_world(wo))
    depth = settings.depth - 1
    by_chance = fresh_sampler(settings.seed + 0x2C1B3C6D, dr.width(wo)).next_1d()
    sent = sent_on(scene, shape, sampler, ray, settings.light_paths, depth, si=si, wo=wo, met=met, by_chance=by_chance)
    return sent * (1.0 / settings.proposal.density(si.wi, wo, hits.coat, hits.diffuse))


def _lit(
    hits: TargetHits, wo: mi.Vector3f, weight: mi.Color3f, keep: mi.Bool, returned: tuple[mi.Color3f, ...] | None = None
) -> Callable[[], TechniqueLanes]:
    """Start to compute lanes; returns what waits for those to keep, while the next technique is traced in Python."""
    weight = mi.Color3f(weight)
    keep = keep & dr.all(dr.isfinite(weight))
    wi = hits.si.wi
    returned = returned and tuple(dr.select(keep, part, 0.0) for part in returned)
    dr.eval(wi, wo, weight, keep, returned)

    def kept() -> TechniqueLanes:
        index = dr.compress(keep)
        lanes = TechniqueLanes(
            dr.gather(mi.Vector3f, wi, index),
            dr.gather(mi.Vector3f, wo, index),
            dr.gather(mi.Color3f, weight, index),
            dr.gather(mi.UInt32, hits.position, index),
            tuple(dr.gather(type(value), value, index) for value in hits.held),
            returned=returned and dr.gather(mi.Color3f, returned[0], index),
            returned_sums=np.array([summed(part) for part in returned or ()]),
        )
        return lanes if hits.plugin is None or dr.width(index) == 0 else _parted(lanes, hits, index)

    return kept


def _parted(lanes: TechniqueLanes, hits: TargetHits, index: mi.UInt32) -> TechniqueLanes:
    """Lanes of a mix: what its held materials show, and weights for the fitted one, or all that may change, alone."""
    own = dr.gather(mi.SurfaceInteraction3f, hits.own, index)
    wo = lanes.wo
    if hits.plugin.bumped:
        wo = own.to_local(dr.gather(mi.SurfaceInteraction3f, hits.si, index).to_world(wo))
    others = hits.plugin.held_value(own, wo) * lanes.weight
    weight = lanes.weight if hits.plugin.is_open else lanes.weight * hits.plugin.fitted.weight_at(own)
    dr.eval(others, weight)
    return replace(lanes, weight=weight, others=others, returned=lanes.returned if hits.plugin.is_open else None)
