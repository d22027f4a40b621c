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

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .lamps.met_lamps import DELTA
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
    shape: mi.Shape,
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
        size = np.zeros(len(new), np.float32)
        for light in lights:
            size = np.maximum(size, _sizes(*_slopes(light, si, on_target, settings), settings))
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
    light: mi.Emitter, si: mi.SurfaceInteraction3f, on_target: mi.Bool, settings: Highlights
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None, NDArray[np.bool_]]:
    """Slopes (3, cells, 4) of the half vector against the normal, the lobe's axes, and where there is light (cells, 4).

    All are in the world's frame: that of a surface may turn from one ray to the next. The axes (2, 3, cells) are the
    lobe's tangent and bitangent at a cell's first ray, None for a lobe that is as wide along both.
    """
    ds, value = light.sample_direction(si, mi.Point2f(0.5))
    wo = si.to_local(ds.d)
    lit = on_target & (ds.pdf > 0.0) & (wo.z > 0.0) & (si.wi.z > 0.0) & (dr.max(value) > 0.0)
    half = si.wi + wo
    slope, frame = si.to_world(mi.Vector3f(half.x / half.z, half.y / half.z, 0.0)), si.sh_frame
    dr.eval(slope, frame.s, frame.t, lit)  # one kernel, whether the axes are wanted or not

    def of_world(vector: mi.Vector3f) -> NDArray[np.float32]:
        return np.stack([vector[axis].numpy() for axis in range(3)]).reshape(3, -1, 4)

    axes = None
    if settings.narrow < 1.0:
        angle = np.float32(2.0 * np.pi * settings.turn)
        s, t = of_world(frame.s)[..., 0], of_world(frame.t)[..., 0]
        axes = np.stack([np.cos(angle) * s + np.sin(angle) * t, np.cos(angle) * t - np.sin(angle) * s])
    return of_world(slope), axes, np.array(lit).reshape(-1, 4)


def _sizes(
    slope: NDArray[np.float32], axes: NDArray[np.float32] | None, lit: NDArray[np.bool_], settings: Highlights
) -> NDArray[np.float32]:
    """Half diagonals of cells in slopes, relative to the scale on which a lobe changes there; 0 in the dark.

    A lobe of widths ax and ay = r ax, r < 1, changes along its bitangent over sqrt(ay^2 + ty^2 + (r tx)^2).
    """
    sizes = np.zeros(len(lit), np.float32)
    seen = np.flatnonzero(lit.sum(-1) > 1)  # most cells are beside the target
    lit = lit[seen]
    slope = np.where(lit, slope[:, seen], np.float32(0.0))
    middle = slope.sum(-1) / lit.sum(-1, dtype=np.float32)
    away = (slope - middle[..., None]) * lit
    reach = np.float32(1.0 / (2.0 * GAUSS))  # corners lie further out than the points
    narrowest, narrow = np.float32(settings.narrowest), np.float32(settings.narrow)
    size = reach * np.linalg.norm(away, axis=0).max(-1) / (narrowest + np.linalg.norm(middle, axis=0))
    if axes is not None:
        # one frame for a cell: where it turns within one, smaller cells are no help
        tangent, bitangent = axes[:, :, seen]
        tx, ty = (np.sum(axis * middle, axis=0) for axis in (tangent, bitangent))
        across = reach * np.abs(np.sum(bitangent[..., None] * away, axis=0)).max(-1)
        size = np.maximum(size, across / np.sqrt(narrowest**2 + ty**2 + (narrow * tx) ** 2))
    sizes[seen] = size
    return sizes
