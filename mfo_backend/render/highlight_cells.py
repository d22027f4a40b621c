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
    scale on which the lobe changes there. At most `most` cells are split.
    """

    narrowest: float = 1e-3  # Mitsuba's coat of gloss 1; roughness 0.05 has 2.5e-3
    share: float = 0.5
    most: int = 60_000
    levels: int = 9  # 1 / 512 of the first cell


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
        size = np.zeros(len(new))
        for light in lights:
            size = np.maximum(size, _sizes(*_slopes(light, si, on_target), settings.narrowest))
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
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Slopes (3, cells, 4) of the half vector against the normal, in the world's frame, and where there is light."""
    ds, value = light.sample_direction(si, mi.Point2f(0.5))
    wo = si.to_local(ds.d)
    lit = on_target & (ds.pdf > 0.0) & (wo.z > 0.0) & (si.wi.z > 0.0) & (dr.max(value) > 0.0)
    half = si.wi + wo
    # a frame's tangents may turn from one ray to the next, the world's axes do not
    slope = si.to_world(mi.Vector3f(half.x / half.z, half.y / half.z, 0.0))
    dr.eval(slope, lit)
    return np.stack([slope[axis].numpy() for axis in range(3)]).reshape(3, -1, 4), np.array(lit).reshape(-1, 4)


def _sizes(slope: NDArray[np.float32], lit: NDArray[np.bool_], narrowest: float) -> NDArray[np.float64]:
    """Half diagonals of cells in slopes, relative to the scale on which a lobe changes there; 0 in the dark."""
    count = np.maximum(lit.sum(-1), 1)
    slope = np.where(lit, slope, 0.0)
    middle = slope.sum(-1) / count
    away = np.linalg.norm(slope - middle[..., None], axis=0) * lit
    radius = away.max(-1) / (2.0 * GAUSS)  # corners lie further out than the points
    return np.where(count > 1, radius / (narrowest + np.linalg.norm(middle, axis=0)), 0.0)
