# SPDX-License-Identifier: Apache-2.0
"""Which pixels or tiles a stage looks at, and with how many rays: few values need few residuals."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.colour import luminance
from ...render.camera.widened_mask import widened
from ...render.paths.recorded_paths import LaneGroups, RecordedPaths
from ...types.image import Pixels
from ..plans import RecordedPlan
from ..tolerances import DIM_FLOOR

# A pixel with background in it depends on the exact positions of its samples, which the reference does not share
MINIMUM_INTERIOR_SHARE = 0.3
MINIMUM_LIGHT_SHARE = 0.5  # of the target's light in the reference
MINIMUM_LIT_SHARE = 0.1  # of the recorded lanes: a lamp behind the target lights the silhouette and little else
# Camera rays along each axis of a pixel where lights are exact: everywhere; where the picture changes by a tenth to
# the next pixel; by half, as at the edge of a shadow. Highlights get their own (`render/camera/highlight_cells.py`).
GRID_PLAIN, GRID_DETAIL, GRID_EDGE = 2, 6, 12
DETAIL, EDGE = 0.1, 0.5  # changes to the next pixel, of the logarithm. No measurement
FINER = 2  # rays along each axis at the solution, relative to those a start is found with
FINEST = 60
MOST_FINE_RAYS = 500_000  # above, pixels are small enough for the first recording
# A recording that leaves pixels out: no more of them than this share; so many of the brightest are in it; and what
# counts as lit, of the median of the target
MOST_THINNED, MOST_BRIGHT, LIT = 0.6, 100, 0.01
SMALL_TARGET = 16  # a target this small may lie between the rays of a coarser grid
LEAST_GROUPS = 64  # of an even spread: the least that can hold twenty unknowns. No measurement
BRIGHT_PART = 3  # the brightest groups have no more than one lane of so many. No measurement
FIREFLY = 10.0  # times the brightest of the eight neighbours; a highlight that a pixel resolves falls off slower
_AROUND = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if (dy, dx) != (0, 0)]


def all_groups(paths: RecordedPaths, side: int, reference: Pixels | None = None) -> LaneGroups:
    """All pixels or tiles of this `side` without background; those on the silhouette too where the target is small or
    hardly lit elsewhere, or if most of the target's light in `reference` is there."""
    interior = paths.interior

    def make(keep: NDArray[np.bool_] | None = None) -> LaneGroups:
        return paths.pixel_groups(keep) if side == 1 else paths.tile_groups(keep, side)

    if interior.mean() < MINIMUM_INTERIOR_SHARE:
        return make()
    groups = make(interior)
    enough = len(groups.pixels) >= MINIMUM_INTERIOR_SHARE * len(paths.pixel)
    enough = enough and groups.lanes > MINIMUM_LIT_SHARE * paths.lanes
    if enough and reference is not None:
        light = luminance((reference - paths.constant).reshape(-1, 3)[paths.pixel])
        enough = light[interior].sum() > MINIMUM_LIGHT_SHARE * light.sum()
    return groups if enough else make()


def fewer_groups(groups: LaneGroups, reference: Pixels, lanes: int) -> LaneGroups:
    """A subset of at most about `lanes` recorded lanes: evenly spread ones, and the brightest for the highlights."""
    size = groups.lanes_of_groups
    if size.sum() <= lanes:
        return groups
    bright = np.argsort(luminance(groups.average(reference)))[::-1]
    bright = bright[np.cumsum(size[bright]) <= lanes // BRIGHT_PART]
    rest = np.setdiff1d(np.arange(len(groups)), bright)
    # what is left of the budget goes to an even spread
    count = max(int(len(rest) * (lanes - size[bright].sum()) / max(size[rest].sum(), 1)), LEAST_GROUPS)
    spread = rest[np.linspace(0, len(rest) - 1, min(count, len(rest))).astype(int)]
    return groups.take(np.union1d(spread, bright))


def edges_of_light(paths: RecordedPaths, groups: LaneGroups) -> NDArray[np.bool_] | None:
    """Pixels (height, width) of the silhouette, and between lit ones and others; None where the groups have none of it.

    There a sliver of a pixel may be all that is lit.
    """
    if paths.interior[groups.member].all():
        return None
    lit, silhouette = (np.zeros(paths.constant.shape[:2], bool) for _ in range(2))
    lit.reshape(-1)[paths.pixel[np.diff(paths.first[0]) > 0]] = True
    silhouette.reshape(-1)[paths.pixel[~paths.interior]] = True
    return silhouette | (widened(lit, 1) & widened(~lit, 1))


def detail_grid(
    reference: Pixels, mask: NDArray[np.bool_], edges: NDArray[np.bool_] | None = None
) -> NDArray[np.int64]:
    """Camera rays along each axis for the pixels (height, width) of a picture, more where it has detail on the target.

    The finest grid is not for pixels at the silhouette, whose change is that to the background, unless `edges` are
    given, which have it.
    """
    value = luminance(reference)
    lit = value[mask & (value > 0.0)]
    floor = DIM_FLOOR * float(np.median(lit)) if lit.size else 1.0
    level = np.log(np.maximum(value, 0.0) + floor)
    change, inside = np.zeros_like(level), mask.copy()
    for axis in (0, 1):
        for shift in (1, -1):
            inside &= np.roll(mask, shift, axis)
            change = np.maximum(change, np.abs(level - np.roll(level, shift, axis)))
    grid = np.full(level.shape, GRID_PLAIN)
    grid[mask & (change > DETAIL)] = GRID_DETAIL
    grid[inside & (change > EDGE)] = GRID_EDGE
    if edges is not None:
        grid[edges] = GRID_EDGE
    if mask.sum() <= SMALL_TARGET:
        grid[mask] = GRID_EDGE
    return grid


def solution_grid(
    reference: Pixels,
    mask: NDArray[np.bool_],
    picture: Callable[[], Pixels],
    edges: NDArray[np.bool_] | None = None,
) -> NDArray[np.int64] | None:
    """Camera rays along each axis of a recording at the solution, whose `picture` is asked for its detail; None where
    that would be too many. `edges` are those of `detail_grid`."""
    counted = mask if edges is None else mask | edges
    grid = detail_grid(reference, mask, edges)
    if _rays(_finer(grid), counted) > MOST_FINE_RAYS:
        return None
    grid = _finer(np.maximum(grid, detail_grid(picture(), mask)))
    return None if _rays(grid, counted) > MOST_FINE_RAYS else grid


def thinned_grid(grid: NDArray[np.int64], reference: Pixels, mask: NDArray[np.bool_], rays: int) -> NDArray[np.int64]:
    """`grid` without rays in most pixels, so that those evenly spread over the lit target take about so many `rays` and
    its brightest come on top; all of it where most pixels would stay, or where a solution is recorded more finely.

    Few pixels hold most of a recording's lanes, those of highlights, and a fit looks at a small part of them all.
    """
    value = luminance(reference)
    lit = mask & (value > LIT * np.median(value[mask]))
    share = rays / max(_rays(grid, lit), 1)
    if share > MOST_THINNED or _rays(_finer(grid), mask) <= MOST_FINE_RAYS:
        return grid
    y, x = np.indices(mask.shape)
    # M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences" (2018): even whatever the share, without
    # the rows and columns that every n-th pixel may fall on
    kept = (0.7548776662466927 * x + 0.5698402909980532 * y) % 1.0 < share
    bright = np.flatnonzero(mask)[np.argsort(value[mask])[-MOST_BRIGHT:]]
    kept.reshape(-1)[bright] = True
    return np.where(kept & mask, grid, 0)


def _finer(grid: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.maximum(np.minimum(FINER * grid, FINEST), grid)


def _rays(grid: NDArray[np.int64], mask: NDArray[np.bool_]) -> int:
    return int(np.square(grid)[mask].sum())


def finer_grid(grid: int, noise: float, share: float, plan: RecordedPlan, finest: Callable[[float], int]) -> int:
    """The grid, squared the camera rays of a pixel, with which a recording's own noise is low enough.

    With the present `grid` it is `noise` of a tile's radiance and `share` of the mean square residual, both at least 0
    and `share` at most 1. `finest` is the grid that so many lanes allow. The answer is never coarser than `grid`.
    """
    finer = grid
    if noise >= plan.too_noisy:
        finer = min(math.ceil(grid * noise / plan.low_noise), plan.grid_finest, finest(math.inf))
    if share > plan.most_own:
        # more rays leave the rest of the residual as it is
        odds, wanted = share / max(1.0 - share, 1e-6), plan.low_own / (1.0 - plan.low_own)
        clean = math.ceil(grid * math.sqrt(odds / wanted))
        finer = max(finer, min(clean, plan.grid_finest, finest(plan.clean_lanes)))
    return max(finer, grid)


def without_fireflies(image: Pixels, mask: NDArray[np.bool_]) -> tuple[Pixels, int]:
    """The linear image (height, width, 3) with fireflies inside `mask` set to the mean around them, and their number.

    Only for finding a start: the mean of the picture loses what they carry.
    """
    height, width = mask.shape
    level = luminance(image)
    padded = np.pad(level, 1, mode="edge")
    near = np.zeros_like(level)
    for dy, dx in _AROUND:
        np.maximum(near, padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width], out=near)
    floor = DIM_FLOOR * float(level[mask].mean()) if mask.any() else 0.0
    row, column = np.nonzero(mask & (level > FIREFLY * np.maximum(near, floor)))
    around = [image[np.clip(row + dy, 0, height - 1), np.clip(column + dx, 0, width - 1)] for dy, dx in _AROUND]
    calm = image.astype(np.float32)
    calm[row, column] = np.mean(around, axis=0)
    return calm, len(row)
