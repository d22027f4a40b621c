# SPDX-License-Identifier: Apache-2.0
"""Random walks of light below a surface, from where a view enters to where it leaves again.

A walk stays inside of its body, whatever else is there, as Cycles' does inside of its object
(kernel/integrator/subsurface.h). How far it goes between collisions is drawn for one
of several extinctions, and its density is that of all of them (A. Wilkie et al., "Hero Wavelength Spectral Sampling",
2014), so that one walk serves all channels and values nearby. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...material.lobes.microfacet import sample_visible, visible_pdf
from ...material.principled.disk_profile import DiskProfile
from ...material.principled.random_walk import LEAST_INDEX, MOST_COLLISIONS, MOST_INDEX, Below
from ..random_numbers.path_random import PathRandom
from .bodies import bodies_of, met_inside
from .disk_probes import probed

# Collisions that a walk survives whatever is absorbed: a short one that ended by chance is only noise. No measurement
SPARED_COLLISIONS = 8
_PER_COLLISION = 4  # places of the random numbers


@dataclass(frozen=True)
class Walks:
    """Where walks have left, `out` if they did: hits seen from outside, and what `random_walk.WALK` holds of each."""

    si: Any
    out: Any
    held: tuple[Any, ...]


def materials_with_below(scene: mi.Scene) -> list[Any]:
    """The materials of a scene that let light walk below their surface."""
    found = {id(bsdf): bsdf for bsdf in (shape.bsdf() for shape in scene.shapes()) if getattr(bsdf, "has_below", False)}
    return list(found.values())


def walks_at(bsdf: mi.BSDFPtr, materials: Sequence[Any]) -> mi.Bool:
    """Whether a surface is of one of these `materials`: of a mix or what rays tell apart a Lambert lobe stands in."""
    found = mi.Bool(False)
    for material in materials:
        found |= bsdf == mi.BSDFPtr(material)
    return found


def walked(
    scene: mi.Scene,
    si: mi.SurfaceInteraction3f,
    below: Below,
    random: PathRandom,
    active: mi.Bool,
    *,
    spread: Sequence[float] = (1.0,),
    alphas: Sequence[float] = (),
    choice: mi.Float | None = None,
) -> Walks:
    """Walk from each hit where `active`, for an extinction of any channel times any of `spread`.

    Which one is chosen by a number in [0, 1), a random one or one of more even ones. Views enter through an interface
    as rough as the material's, or as one of these `alphas`. After a few collisions a walk goes on as probably as the
    brightest channel does.
    """
    medium = below.medium
    if isinstance(medium, DiskProfile):
        exits, out, found = probed(scene, si, medium, random, active, spread=spread, choice=choice)
        nothing = dr.zeros(mi.Float, dr.width(si.p))
        return Walks(exits, out, (*found[:2], nothing, nothing, found[2]))
    extinctions = [medium.extinction[k] * factor for k in range(3) for factor in spread]
    d, h, entry_density, enters = _entered(si, below, random, alphas)
    width = dr.width(si.p)
    chosen = (random.pair(0).x if choice is None else choice) * len(extinctions)
    free = extinctions[0] + dr.zeros(mi.Float, width)
    for k, extinction in enumerate(extinctions[1:], 1):
        free = dr.select(chosen >= k, extinction, free)
    shape, prim, bodies = mi.ShapePtr(si.shape), mi.UInt32(si.prim_index), bodies_of(scene)
    g, survival = (value + dr.zeros(mi.Float, width) for value in (medium.anisotropy, dr.max(medium.albedo)))
    length, out = dr.zeros(mi.Float, width), dr.full(mi.Bool, False, width)
    state = (
        mi.Point3f(si.p), d, dr.zeros(mi.UInt32, width), length, active & enters & ~out, out,
        dr.zeros(mi.PreliminaryIntersection3f, width),
        shape, prim, free, g, survival, mi.UInt32(random.a), mi.UInt32(random.b),
    )  # fmt: skip

    def step(p, d, collisions, length, active, out, found, shape, prim, free, g, survival, a, b):
        numbers = PathRandom(a, b)
        place = _PER_COLLISION * collisions
        u = numbers.pair(place + 1)
        t = -dr.log(1.0 - u.x) / free
        ray = mi.Ray3f(p, d, t, 0.0, mi.Color0f())
        met = met_inside(scene, bodies, ray, shape, prim, collisions == 0, active)
        leaves = active & met.is_valid()
        found = dr.select(leaves, met, found)
        out |= leaves
        collides = active & ~leaves
        length = length + dr.select(leaves, met.t, dr.select(collides, t, 0.0))
        collisions = collisions + dr.select(collides, 1, 0)
        goes_on = collides & (collisions < MOST_COLLISIONS)
        goes_on &= (collisions <= SPARED_COLLISIONS) | (u.y < survival)
        scattered = _scattered(d, g, numbers.pair(place + 2))
        p = dr.select(goes_on, p + t * d, p)
        d = dr.select(goes_on, scattered, d)
        return p, d, collisions, length, goes_on, out, found, shape, prim, free, g, survival, a, b

    p, d, collisions, length, _, out, found, *_ = dr.while_loop(
        state, lambda *s: s[4], step, mode="evaluated", compress=width > 1, label="random walks"
    )
    exits = found.compute_surface_interaction(mi.Ray3f(p, d, dr.inf, 0.0, mi.Color0f()), mi.RayFlags.All, out)
    # as Cycles turns them, by the triangle's own side: a smooth normal may well look away from the walk
    exits.sh_frame.n = dr.mulsign(exits.sh_frame.n, dr.dot(exits.n, d))  # its axes are those of normal maps
    exits.wi = exits.to_local(d)
    count = mi.Float(collisions)
    passed = dr.log(survival) * dr.maximum(count - SPARED_COLLISIONS, 0.0)
    logs = [dr.log(extinction) * count - extinction * length for extinction in extinctions]
    largest = logs[0]
    for each in logs[1:]:
        largest = dr.maximum(largest, each)
    density = sum(dr.exp(each - largest) for each in logs) / len(logs)
    log_density = largest + dr.log(density) + passed + dr.log(entry_density)
    return Walks(exits, out, (count, length, h.x, h.y, log_density))


def _entered(
    si: mi.SurfaceInteraction3f, below: Below, random: PathRandom, alphas: Sequence[float]
) -> tuple[mi.Vector3f, mi.Vector3f, mi.Float, mi.Bool]:
    """The direction below the surface, the microfacet's normal and its density, and whether there is one."""
    u, choice = random.pair(1 << 16), random.pair(1 << 17)
    wi, ior = si.wi, dr.clip(mi.Float(below.ior), LEAST_INDEX, MOST_INDEX)
    widths = [mi.Float(below.alpha)] if below.skin or not alphas else [dr.opaque(mi.Float, alpha) for alpha in alphas]
    drawn = widths[0]
    for k, alpha in enumerate(widths[1:], 1):
        drawn = dr.select(choice.y * len(widths) >= k, alpha, drawn)
    h = sample_visible(wi, drawn, drawn, u)
    density = sum(visible_pdf(wi, h, alpha, alpha) for alpha in widths) / len(widths)
    if below.skin:  # whose interface is always the same
        density = mi.Float(1.0)
    c = dr.dot(wi, h)
    bent = h * (c / ior - dr.safe_sqrt(1.0 - (1.0 - c * c) / (ior * ior))) - wi / ior
    if below.skin:
        bent = dr.select(choice.x < 0.5, -mi.warp.square_to_cosine_hemisphere(u), bent)
    d = si.to_world(bent)
    outside = dr.select(dr.dot(si.n, si.to_world(wi)) < 0.0, -mi.Vector3f(si.n), mi.Vector3f(si.n))
    return dr.normalize(d), h, density, (wi.z > 0.0) & (dr.dot(outside, d) < 0.0)


def _scattered(d: mi.Vector3f, g: mi.Float, u: mi.Point2f) -> mi.Vector3f:
    """A direction of the phase function of Henyey and Greenstein after `d`."""
    ratio = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x)
    bent = (1.0 + g * g - ratio * ratio) / dr.select(dr.abs(g) < 1e-3, 1.0, 2.0 * g)
    cosine = dr.clip(dr.select(dr.abs(g) < 1e-3, 1.0 - 2.0 * u.x, bent), -1.0, 1.0)
    sine = dr.safe_sqrt(1.0 - cosine * cosine)
    s, c = dr.sincos(2.0 * dr.pi * u.y)
    return dr.normalize(mi.Frame3f(d).to_world(mi.Vector3f(c * sine, s * sine, cosine)))
