# SPDX-License-Identifier: Apache-2.0
"""Light paths that do not depend on the material: where they reach the target, from where, and what they carry.

For fixed geometry, camera and light only the BSDF at the first hit changes during a fit. A lane keeps the two directions
in the shading frame and the weight by which the BSDF value counts in its pixel; an iteration then needs no rays and no
random numbers, so the objective is deterministic.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..types.image import Pixels

ENOUGH_GROUPS = 4096  # kernel lanes that keep the vector units of a few cores busy
BYTES_PER_LANE = 36  # three float32 each for wi, wo and the weight


@dataclass(frozen=True)
class LaneGroups:
    """Runs of lanes that are summed into one residual each: single pixels or tiles of pixels.

    `start` and `stop` bound the lanes of each part, `scale` is one over the number of pixels of its group. A part is a
    group, or a pixel of it where there are too few groups to keep all cores busy. `pixels` lists the flat pixel indices of
    all groups one after the other, `first` (g + 1) where each group's begin.
    """

    start: mi.UInt32
    stop: mi.UInt32
    scale: mi.Float
    pixels: NDArray[np.int64]
    first: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.first) - 1

    def average(self, image: Pixels) -> NDArray[np.float32]:
        """Mean of `image` (height, width, 3) over the pixels of each group, shape (g, 3)."""
        flat = image.reshape(-1, image.shape[-1])[self.pixels]
        count = np.diff(self.first)
        if count.max(initial=1) == 1:
            return flat
        sums = np.add.reduceat(flat.astype(np.float64), self.first[:-1], axis=0)
        return (sums / count[:, None]).astype(np.float32)

    def add_parts(self, parts: NDArray[np.float32]) -> NDArray[np.float32]:
        """Sums over the parts of each group, along the first axis."""
        return parts if len(parts) == len(self) else np.add.reduceat(parts, self.first[:-1], axis=0)


@dataclass(frozen=True)
class RecordedPaths:
    """All lanes of one recording, ordered by tile, then pixel.

    Attributes
    ----------
    wi, wo
        Unit directions to the camera and to the light in the shading frame.
    weight
        Incident radiance x visibility x multiple importance weight / density x pixel filter, linear Rec.709.
    pixel, tile
        Flat index of each covered pixel (row * width + column) and the number of its tile.
    first
        Lanes of covered pixel p are `first[p]` to `first[p + 1]`; shape (p + 1,).
    coverage
        Share of each covered pixel's filter weight that lies on the target.
    constant
        What does not depend on the target's BSDF at the first hit, (height, width, 3): background and other objects seen
        in covered pixels; 0 elsewhere.
    primary_rays
        Camera rays per pixel.
    """

    wi: mi.Vector3f
    wo: mi.Vector3f
    weight: mi.Color3f
    pixel: NDArray[np.int64]
    tile: NDArray[np.int64]
    first: NDArray[np.int64]
    coverage: NDArray[np.float32]
    constant: Pixels
    primary_rays: int

    @property
    def lanes(self) -> int:
        return int(self.first[-1])

    @property
    def bytes(self) -> int:
        """Memory of the lanes."""
        return self.lanes * BYTES_PER_LANE

    @property
    def interior(self) -> NDArray[np.bool_]:
        """Covered pixels without background in them."""
        return self.coverage > 0.999

    def pixel_groups(self, chosen: NDArray[np.int64] | None = None) -> LaneGroups:
        """One group for each covered pixel, or for the `chosen` ones (positions in `pixel`)."""
        index = np.arange(len(self.pixel)) if chosen is None else np.asarray(chosen)
        return _groups(self.first, self.pixel, index, np.arange(len(index) + 1))

    def tile_groups(self, minimum_pixels: int = 1, keep: NDArray[np.bool_] | None = None) -> LaneGroups:
        """One group for each tile with at least `minimum_pixels` covered pixels, all of them inside `keep` if given."""
        begin = np.flatnonzero(np.diff(self.tile, prepend=-1))
        end = np.append(begin[1:], len(self.tile))
        good = end - begin >= minimum_pixels
        if keep is not None:
            good &= np.logical_and.reduceat(keep, begin)
        begin, end = begin[good], end[good]
        parts = [np.arange(b, e) for b, e in zip(begin, end, strict=True)]
        index = np.concatenate(parts) if parts else np.zeros(0, int)
        first = np.concatenate([[0], np.cumsum(end - begin)])
        return _groups(self.first, self.pixel, index, first)


def _groups(first_lane: NDArray, pixel: NDArray, index: NDArray, first: NDArray) -> LaneGroups:
    """Groups of the covered pixels `index`, whose groups begin at `first`."""
    count = np.diff(first)
    scale = 1.0 / count
    start, stop = first_lane[index], first_lane[index + 1]
    if len(count) >= ENOUGH_GROUPS:
        start, stop = start[first[:-1]], stop[first[1:] - 1]
    else:
        scale = np.repeat(scale, count)
    groups = LaneGroups(
        mi.UInt32(start.astype(np.uint32)), mi.UInt32(stop.astype(np.uint32)), mi.Float(scale.astype(np.float32)),
        pixel[index], first,
    )
    dr.eval(groups.start, groups.stop, groups.scale)
    return groups
