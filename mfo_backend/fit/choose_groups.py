# SPDX-License-Identifier: Apache-2.0
"""Which pixels or tiles a stage looks at: few scalars need few residuals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..metrics.colour import luminance
from ..render.recorded_paths import LaneGroups, RecordedPaths
from ..types.image import Pixels

# A pixel with background in it depends on the exact positions of its samples, which the reference does not share
MINIMUM_INTERIOR_SHARE = 0.3


def all_groups(paths: RecordedPaths, *, tiles: bool) -> LaneGroups:
    """All pixels or tiles without background; those on the silhouette too where the target is small."""
    interior = paths.interior
    make = paths.tile_groups if tiles else paths.pixel_groups
    if interior.mean() < MINIMUM_INTERIOR_SHARE:
        return make()
    groups = make(interior)
    enough = len(groups.pixels) >= MINIMUM_INTERIOR_SHARE * len(paths.pixel)
    return groups if enough else make()


def fewer_groups(groups: LaneGroups, reference: Pixels, lanes: int) -> LaneGroups:
    """A subset of at most about `lanes` recorded lanes: evenly spread ones, and the brightest for the highlights."""
    share = lanes / max(groups.lanes, 1)
    if share >= 1.0:
        return groups
    count = max(int(len(groups) * share), min(len(groups), 64))
    spread = np.linspace(0, len(groups) - 1, max(count * 3 // 4, 1)).astype(int)
    bright: NDArray[np.int64] = np.argsort(luminance(groups.average(reference)))[-max(count // 4, 1) :]
    return groups.take(np.union1d(spread, bright))


def detailed_pixels(reference: Pixels) -> NDArray[np.bool_]:
    """Pixels (height, width) that differ from a neighbour by more than a tenth: highlights and edges inside a pixel."""
    value = luminance(reference)
    floor = 0.1 * float(np.median(value[value > 0.0])) if (value > 0.0).any() else 1.0
    level = np.log(np.maximum(value, 0.0) + floor)
    detailed = np.zeros(level.shape, bool)
    for axis in (0, 1):
        jump = np.abs(np.diff(level, axis=axis)) > 0.1
        before = [(0, 0), (0, 0)]
        after = [(0, 0), (0, 0)]
        before[axis], after[axis] = (0, 1), (1, 0)
        detailed |= np.pad(jump, before) | np.pad(jump, after)
    return detailed
