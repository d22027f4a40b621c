# SPDX-License-Identifier: Apache-2.0
"""Smaller cells of a pixel where a light of no extent is seen in a mirror-like lobe.

Such a highlight is narrower than a pixel. The slope t of the half vector against the normal is all that a microfacet
distribution of width alpha depends on, and it changes by a factor over max(alpha, t): so a cell is small enough once
its slopes differ by a share of that. Cells then shrink towards the point of the mirror image, and halving alpha costs
one more ring of them instead of four times the rays. Points are those of Gauss and Legendre, two along each axis, whose
error falls with the fourth power of the side.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

import drjit as dr
import mitsuba as mi
import numpy as np

from ..lamps.met_lamps import DELTA
from .pixel_cells import PixelCells
from .primary_rays import GAUSS, PrimaryRays


@dataclass(frozen=True)
class Highlights:
    """How finely highlights are resolved.

    `narrowest` is the smallest width alpha of a lobe to resolve, `share` the half diagonal of a cell in slopes over the
    scale on which the lobe changes there. At most `most` cells are split. `narrow` is the width of an anisotropic lobe
    along its bitangent relative to that along its tangent, and `turn` how far, in full turns, the lobe's axes are
    turned from the surface's.
    """

    narrowest: float = 1e-3  # Mitsuba's coat of gloss 1; roughness 0.05 has 2.5e-3
    share: float = 0.5
    most: int = 60_000
    levels: int = 9  # 1 / 512 of the first cell
    narrow: float = 1.0
    turn: float = 0.0


def highlight_cells(
    scene: mi.Scene,
    cells: PixelCells,
    rays_in: Callable[[PixelCells], PrimaryRays],
    first_hits: Callable[[PrimaryRays], tuple[mi.SurfaceInteraction3f, mi.Bool]],
    settings: Highlights,
) -> PixelCells:
    """`cells` with those split, again and again, that see the mirror image of a light of no extent.

    `rays_in` gives four rays of a cell, one after the other, `first_hits` what they meet and whether it is the target.
    """
    lights = [emitter for emitter in scene.emitters() if mi.has_flag(emitter.flags(), DELTA)]
    done, new, left = [], cells, settings.most
    for _ in range(settings.levels if lights else 0):
        si, on_target = first_hits(rays_in(new))
        sizes = [_sizes(*_slopes(light, si, on_target), settings) for light in lights]
        size = np.maximum.reduce([of_light.numpy() for of_light in sizes])
        split = size > settings.share
        if split.sum() > left:  # the coarsest first
            split &= size > np.partition(size, -left - 1)[-left - 1]
        if not split.any():
            break
        left -= int(split.sum())
        done.append(new.take(~split))
        new = new.take(split).quarters()
    return PixelCells.joined([*done, new])


def _slopes(
    light: mi.Emitter, si: mi.SurfaceInteraction3f, on_target: mi.Bool
) -> tuple[mi.Vector3f, mi.Frame3f, mi.Bool]:
    """The slope of the half vector against the normal, the surface's frame and whether there is light, for each ray.

    Slopes are in the world's frame: that of a surface may turn from one ray to the next.
    """
    ds, value = light.sample_direction(si, mi.Point2f(0.5))
    wo = si.to_local(ds.d)
    lit = on_target & (ds.pdf > 0.0) & (wo.z > 0.0) & (si.wi.z > 0.0) & (dr.max(value) > 0.0)
    half = si.wi + wo
    slope, frame = si.to_world(mi.Vector3f(half.x / half.z, half.y / half.z, 0.0)), si.sh_frame
    dr.eval(slope, frame, lit)
    return slope, frame, lit


def _sizes(slope: mi.Vector3f, frame: mi.Frame3f, lit: mi.Bool, settings: Highlights) -> mi.Float:
    """Half diagonals of cells in slopes, relative to the scale on which a lobe changes there; 0 in the dark.

    A lobe of widths ax and ay = r ax, r < 1, changes along its bitangent over sqrt(ay^2 + ty^2 + (r tx)^2).
    """
    first = 4 * dr.arange(mi.UInt32, dr.width(lit) // 4)
    rays = [first + k for k in range(4)]
    seen = [dr.gather(mi.Bool, lit, ray) for ray in rays]
    slopes = [dr.gather(mi.Vector3f, slope, ray, active) for ray, active in zip(rays, seen, strict=True)]
    count = sum(dr.select(active, mi.Float(1.0), 0.0) for active in seen)
    middle = sum(slopes[1:], slopes[0]) / count
    away = [dr.select(active, s - middle, 0.0) for s, active in zip(slopes, seen, strict=True)]
    reach = 1.0 / (2.0 * GAUSS)  # corners lie further out than the points
    # all settings are data: others need no other kernel
    angle = 2.0 * math.pi * settings.turn
    narrowest, narrow, cosine, sine = (
        dr.opaque(mi.Float, number)
        for number in (settings.narrowest, settings.narrow, math.cos(angle), math.sin(angle))
    )
    size = reach * dr.sqrt(_largest([dr.squared_norm(a) for a in away])) / (narrowest + dr.norm(middle))
    # one frame for a cell: where it turns within one, smaller cells are no help
    s, t = (dr.gather(mi.Vector3f, axis, first) for axis in (frame.s, frame.t))
    tangent, bitangent = cosine * s + sine * t, cosine * t - sine * s
    across = reach * _largest([dr.abs(dr.dot(bitangent, a)) for a in away])
    tx, ty = (dr.dot(axis, middle) for axis in (tangent, bitangent))
    across /= dr.sqrt(dr.square(narrowest) + dr.square(ty) + dr.square(narrow * tx))
    size = dr.select(narrow < 1.0, dr.maximum(size, across), size)
    size = dr.select(count > 1.0, size, 0.0)  # most cells are beside the target
    dr.eval(size)
    return size


def _largest(values: list[mi.Float]) -> mi.Float:
    return reduce(dr.maximum, values)
