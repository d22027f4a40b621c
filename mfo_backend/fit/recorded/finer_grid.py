# SPDX-License-Identifier: Apache-2.0
"""How many rays a recording needs, so that its own noise is low enough."""

from __future__ import annotations

import math
from collections.abc import Callable

from ..plans import RecordedPlan


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
