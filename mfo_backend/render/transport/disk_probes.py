# SPDX-License-Identifier: Apache-2.0
"""Where light of a `DiskProfile` leaves: hits of a body around a point, found by rays through a disk.

A. King et al., "BSSRDF Importance Sampling" (2013), as in Cycles (kernel/integrator/subsurface_disk.h): one of three
axes, a point on a disk across it, and of all hits of the line through that one, as probable as it is bright. Choose the
variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi

from ...material.principled.disk_profile import END, LEAST_WIDTH, SHARE_BEFORE_END, DiskProfile, leaving
from ..random_numbers.path_random import PathRandom
from .bodies import bodies_of, met_inside

AXES = (0.5, 0.25, 0.25)  # probabilities of the normal and of two directions across it
# of one line, what lies beyond is left out; Cycles takes four by chance. Of endless lines through five heads and
# statues 18 to 33 % meet more than 4, 2 to 7 % more than 8, and 0.01 to 0.1 % more than 16
MOST_HITS = 16


def probed(
    scene: mi.Scene,
    si: mi.SurfaceInteraction3f,
    profile: DiskProfile,
    random: PathRandom,
    active: mi.Bool,
    *,
    spread: Sequence[float],
    choice: mi.Float | None,
) -> tuple[mi.SurfaceInteraction3f, mi.Bool, tuple[mi.Float, mi.Float, mi.Float]]:
    """Hits seen from outside, whether there is one, and what `DiskProfile.carried` asks of it.

    Distances are drawn for the width of any channel times any of `spread`, by a number in [0, 1), a random one or one
    of more even ones, and their density is that of all.
    """
    widths = [profile.width[k] * factor for k in range(3) for factor in spread]
    count = dr.width(si.p)
    u, v = random.pair(0), random.pair(1)
    chosen = (v.x if choice is None else choice) * len(widths)
    width, widest = (widths[0] + dr.zeros(mi.Float, count) for _ in range(2))
    for k, each in enumerate(widths[1:], 1):
        width = dr.select(chosen >= k, each, width)
        widest = dr.maximum(widest, each)
    on_disk = _distance(width, u.x)
    density = sum(leaving(each, on_disk) for each in widths) / len(widths)

    frame = mi.Frame3f(mi.Vector3f(si.n))
    by_n, by_s = v.y < AXES[0], v.y < AXES[0] + AXES[1]  # the second with the first
    axis = dr.select(by_n, frame.n, dr.select(by_s, frame.s, frame.t))
    first, second = dr.select(by_n, frame.s, frame.n), dr.select(by_s, frame.t, frame.s)
    sine, cosine = dr.sincos(2.0 * dr.pi * u.y)
    reach = dr.safe_sqrt(dr.square(END * widest) - dr.square(on_disk))
    start = si.p + axis * reach + (first * cosine + second * sine) * on_disk
    line = mi.Ray3f(start, -axis, 2.0 * reach, 0.0, mi.Color0f())

    bodies, shape, prim = bodies_of(scene), mi.ShapePtr(si.shape), mi.UInt32(si.prim_index)
    passed, total, held_bright = (dr.zeros(mi.Float, count) for _ in range(3))
    kept, kept_distance = dr.zeros(mi.PreliminaryIntersection3f, count), dr.zeros(mi.Float, count)
    kept_share = mi.Float(1.0)
    for number in range(MOST_HITS):
        rest = mi.Ray3f(start - axis * passed, -axis, line.maxt - passed, 0.0, mi.Color0f())
        found = met_inside(scene, bodies, rest, shape, prim, mi.Bool(False), active)
        active &= found.is_valid()
        met = found.compute_surface_interaction(rest, mi.RayFlags.Minimal, active)
        # the power heuristic over the axes, over the density by the own one
        facing = [p * dr.abs(dr.dot(a, met.n)) for p, a in zip(AXES, (frame.n, frame.s, frame.t), strict=True)]
        own = dr.select(by_n, facing[0], dr.select(by_s, facing[1], facing[2]))
        share = own / dr.maximum(sum(map(dr.square, facing)), 1e-12)
        distance = dr.maximum(dr.norm(met.p - si.p), LEAST_WIDTH)
        bright = dr.select(active, dr.mean(profile.carried(on_disk, distance, 0.0)) * share, 0.0)
        total += bright
        takes = active & (random.pair(2 + number).x * total < bright)
        found.t += passed
        kept, held_bright = dr.select(takes, found, kept), dr.select(takes, bright, held_bright)
        kept_distance, kept_share = dr.select(takes, distance, kept_distance), dr.select(takes, share, kept_share)
        passed = dr.select(active, found.t * (1.0 + 1e-6) + 1e-7, passed)
        dr.eval(active, total, kept, held_bright, kept_distance, kept_share, passed)
        if not dr.any(active):
            break
    out = held_bright > 0.0
    exits = kept.compute_surface_interaction(line, mi.RayFlags.All, out)
    # outside is the side of the mesh that is seen
    outside = dr.mulsign(mi.Vector3f(exits.n), dr.dot(si.n, si.to_world(si.wi)))
    exits.sh_frame.n = dr.mulsign(exits.sh_frame.n, dr.dot(exits.n, outside))
    exits.wi = exits.to_local(outside)
    likely = dr.select(out, density * held_bright / (total * kept_share), 1.0)
    return exits, out, (on_disk, kept_distance, dr.log(likely))


def _distance(width: mi.Float, u: mi.Float) -> mi.Float:
    """The distance within which a share of what leaves is, for numbers in [0, 1).

    With t = exp(-r / 3 d) the share is 1 - (t^3 + 3 t) / 4, whose root is one of hyperbolic functions.
    """
    t = 2.0 * dr.sinh(dr.asinh(2.0 * (1.0 - u * SHARE_BEFORE_END)) / 3.0)
    return -3.0 * width * dr.log(dr.minimum(t, 1.0))
