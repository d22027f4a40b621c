# SPDX-License-Identifier: Apache-2.0
"""Lanes of light that leaves the target where its camera rays meet it, and entered elsewhere."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from ...material.principled.random_walk import LEAST_ALPHA, WALK, Below
from ...types.light_paths import LightPaths
from ..camera.primary_rays import fresh_sampler
from ..random_numbers.path_random import PathRandom
from ..transport.exit_light import exit_light
from ..transport.subsurface_walks import walked
from .merged_lanes import TechniqueLanes

# Alphas of the interfaces that walks enter through, whatever the material's: what is narrower or wider than the one a
# walk was made for has several times its noise, so that a plain material lost against one with a coat on a rough base
# (docs/notebook/subsurface.md)
ENTRIES = (LEAST_ALPHA, 0.3, 1.0)
_APART = 0x2C1B3C6D
_GOLDEN = 0x9E3779B9  # 2^32 over the golden ratio
_TURN = 1 << 18  # a place of the random numbers that no walk has


@dataclass(frozen=True)
class WalkSettings:
    """How to record walks: one for each ray in each of the independent `samples`; `spread` is that of `walked`.

    With `held` no value of the material changes.
    """

    samples: int
    seed: int
    spread: Sequence[float]
    light_paths: LightPaths | None
    depth: int
    held: bool = False


def walked_lanes(
    scene: mi.Scene,
    hits: TechniqueLanes,
    si: mi.SurfaceInteraction3f,
    below: Below,
    pixels: int,
    settings: WalkSettings,
) -> TechniqueLanes:
    """One lane for each walk that has left again, of all samples.

    `hits` are what lanes of one sample begin with: their `weight` is the share in a pixel, and their values of `held`
    come before those of the walks. `si` is the same surface with the frame that the medium is entered through. Of a
    material that is held there is what it shows, and no lanes.
    """
    count = dr.width(si.p)
    lane, rays = dr.arange(mi.UInt32, settings.samples * count), dr.opaque(mi.UInt32, count)
    random = PathRandom.of(lane, dr.opaque(mi.UInt32, settings.seed ^ _APART))
    sample = lane // rays
    number = lane - sample * rays
    entered, medium = dr.gather(mi.SurfaceInteraction3f, si, number), below.gathered(number)
    reached = dr.max(medium.weight) > 0.0
    place = dr.gather(mi.UInt32, hits.position, number) + sample * pixels
    walks = walked(
        scene, entered, medium, random, reached, spread=settings.spread, alphas=ENTRIES,
        choice=_even_choice(number, place, settings.seed),
    )  # fmt: skip
    index = dr.compress(walks.out)
    ray = dr.gather(mi.UInt32, number, index)
    exits = dr.gather(mi.SurfaceInteraction3f, walks.si, index)
    light = dr.zeros(mi.Color3f, dr.width(index))
    if dr.width(index) > 0:  # none leaves a metal, or a surface that encloses nothing
        sampler = fresh_sampler(settings.seed ^ _APART, dr.width(index))
        light = exit_light(scene, exits, sampler, settings.light_paths, settings.depth)
    weight = light * dr.gather(mi.Float, hits.weight, ray)
    position = dr.gather(mi.UInt32, place, index)
    view = dr.gather(mi.Vector3f, hits.wi, ray)
    kept = [dr.gather(type(value), value, ray) for value in hits.held]
    walk = [dr.gather(mi.Float, value, index) for value in walks.held]
    lanes = TechniqueLanes(view, dr.zeros(mi.Vector3f, dr.width(index)), weight, position, (*kept, *walk))
    if settings.held:
        shown = below.gathered(ray).shown(view, dict(zip(WALK.names, walk, strict=True)))
        lanes = replace(lanes, weight=None, others=weight * shown)
    dr.eval(lanes.wi, lanes.wo, lanes.weight, lanes.position, lanes.held, lanes.others)
    return lanes


def _even_choice(ray: mi.UInt32, pixel: mi.UInt32, seed: int) -> mi.Float:
    """Numbers in [0, 1), evenly over those rays of a pixel that follow each other, and random from pixel to pixel."""
    turn = PathRandom.of(pixel, dr.opaque(mi.UInt32, seed ^ _APART)).pair(_TURN).x
    number = turn + mi.Float((ray * _GOLDEN) >> 8) * 2.0**-24
    return number - dr.floor(number)
