# SPDX-License-Identifier: Apache-2.0
"""Which pixels or tiles a stage looks at: few scalars need few residuals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..metrics.colour import luminance
from ..render.recorded_paths import LaneGroups, RecordedPaths
from ..types.image import Pixels

# A pixel with background in it depends on the exact positions of its samples, which the reference does not share
MINIMUM_INTERIOR_SHARE = 0.3
MINIMUM_LIT_SHARE = 0.1  # of the recorded lanes: a lamp behind the target lights the silhouette and little else


def all_groups(paths: RecordedPaths, side: int) -> LaneGroups:
    """All pixels or tiles of this `side` without background; those on the silhouette too where the target is small or
    hardly lit elsewhere."""
    interior = paths.interior

    def make(keep: NDArray[np.bool_] | None = None) -> LaneGroups:
        return paths.pixel_groups(keep) if side == 1 else paths.tile_groups(keep, side)

    if interior.mean() < MINIMUM_INTERIOR_SHARE:
        return make()
    groups = make(interior)
    enough = len(groups.pixels) >= MINIMUM_INTERIOR_SHARE * len(paths.pixel)
    enough = enough and groups.lanes > MINIMUM_LIT_SHARE * paths.lanes
    return groups if enough else make()


def fewer_groups(groups: LaneGroups, reference: Pixels, lanes: int) -> LaneGroups:
    """A subset of at most about `lanes` recorded lanes: evenly spread ones, and the brightest for the highlights."""
    size = groups.lanes_of_groups
    if size.sum() <= lanes:
        return groups
    bright = np.argsort(luminance(groups.average(reference)))[::-1]
    bright = bright[np.cumsum(size[bright]) <= lanes // 3]
    # what is left of the budget goes to an even spread; 64 groups are the least that can hold twenty unknowns
    count = max(int(len(groups) * (lanes - size[bright].sum()) / size.sum()), 64)
    spread = np.linspace(0, len(groups) - 1, min(count, len(groups))).astype(int)
    return groups.take(np.union1d(spread, bright))


# Camera rays along each axis of a pixel where lights are exact: everywhere; where the picture changes by a tenth to
# the next pixel; by half, as at the edge of a shadow. Highlights get their own (`render/highlight_cells.py`).
GRID_PLAIN, GRID_DETAIL, GRID_EDGE = 2, 6, 12
FINER = 2  # rays along each axis at the solution, relative to those a start is found with
FINEST = 60
MOST_FINE_RAYS = 500_000  # above, pixels are small enough for the first recording
FEW_PIXELS = 16  # a target this small may lie between the rays of a coarser grid


def detail_grid(reference: Pixels, mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Camera rays along each axis for the pixels (height, width) of a picture, more where it has detail on the target.

    The finest grid is not for pixels at the silhouette, whose change is that to the background.
    """
    value = luminance(reference)
    lit = value[mask & (value > 0.0)]
    floor = 0.1 * float(np.median(lit)) if lit.size else 1.0
    level = np.log(np.maximum(value, 0.0) + floor)
    change, inside = np.zeros_like(level), mask.copy()
    for axis in (0, 1):
        for shift in (1, -1):
            inside &= np.roll(mask, shift, axis)
            change = np.maximum(change, np.abs(level - np.roll(level, shift, axis)))
    grid = np.full(level.shape, GRID_PLAIN)
    grid[mask & (change > 0.1)] = GRID_DETAIL
    grid[inside & (change > 0.5)] = GRID_EDGE
    if mask.sum() <= FEW_PIXELS:
        grid[mask] = GRID_EDGE
    return grid


def solution_grid(
    reference: Pixels, mask: NDArray[np.bool_], picture: Callable[[], Pixels]
) -> NDArray[np.int64] | None:
    """Camera rays along each axis of a recording at the solution, whose `picture` is asked for its detail; None where
    that would be too many."""
    grid = detail_grid(reference, mask)
    if _rays(_finer(grid), mask) > MOST_FINE_RAYS:
        return None
    grid = _finer(np.maximum(grid, detail_grid(picture(), mask)))
    return None if _rays(grid, mask) > MOST_FINE_RAYS else grid


def _finer(grid: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.maximum(np.minimum(FINER * grid, FINEST), grid)


def _rays(grid: NDArray[np.int64], mask: NDArray[np.bool_]) -> int:
    return int(np.square(grid)[mask].sum())
