# SPDX-License-Identifier: Apache-2.0
"""Light paths that do not depend on the material: where they reach the target, from where, and what they carry.

For fixed geometry, camera and light only the BSDF at the first hit changes during a fit. A lane keeps the two
directions in the shading frame and the weight by which the BSDF value counts in its pixel; an iteration then needs no
rays and no random numbers, so the objective is deterministic.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from ...types.image import Pixels
from ..camera.primary_rays import TILE, quarter

ENOUGH_PARTS = 4096  # kernel lanes that keep the vector units of a few cores busy
BYTES_PER_LANE, BYTES_OF_RETURNED = 36, 12  # three float32 each for wi, wo and the weight


@dataclass(frozen=True, eq=False)
class LaneGroups:
    """Covered pixels that are averaged into one residual each: single pixels or tiles of pixels.

    `member` lists the positions of all groups' pixels in the recording, `first` (g + 1) where each group's begin;
    `pixels` are their flat indices in the image, `first_lane` (samples, p + 1) the recording's.
    """

    member: NDArray[np.int64]
    first: NDArray[np.int64]
    pixels: NDArray[np.int64]
    first_lane: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.first) - 1

    @property
    def lanes(self) -> int:
        """Recorded lanes in all groups."""
        return int(self.lanes_of_groups.sum())

    @property
    def lanes_of_groups(self) -> NDArray[np.int64]:
        """Recorded lanes in each group."""
        start, stop = self._lane_ranges
        return (stop - start).reshape(self.samples, -1).sum(axis=0)

    @property
    def samples(self) -> int:
        """Independent samples of the light in the recording."""
        return len(self.first_lane)

    def take(self, chosen: NDArray[np.int64]) -> LaneGroups:
        """Only the groups of these numbers."""
        count = np.diff(self.first)[chosen]
        first = np.concatenate([[0], np.cumsum(count)])
        where = np.repeat(self.first[chosen] - first[:-1], count) + np.arange(first[-1])
        return LaneGroups(self.member[where], first, self.pixels[where], self.first_lane)

    @cached_property
    def _lane_ranges(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """First and last + 1 recorded lane of each group in each sample, (samples g,) each.

        A group's pixels follow each other in the recording.
        """
        start, stop = self.member[self.first[:-1]], self.member[self.first[1:] - 1] + 1
        return self.first_lane[:, start].ravel(), self.first_lane[:, stop].ravel()

    @cached_property
    def _parts_per_group(self) -> NDArray[np.int64]:
        start, stop = self._lane_ranges
        longest = int(np.clip(self.lanes // ENOUGH_PARTS, 16, 256))
        return np.maximum(-(-(stop - start) // longest), 1)

    @cached_property
    def parts(self) -> tuple[mi.UInt32, mi.UInt32, mi.Float]:
        """First lane, last lane + 1 and one over the number of pixels, for each lane of the kernel.

        A kernel lane is a group in one sample or, where groups are long or few, a part of that: all cores stay busy and
        neighbours in a vector register take about as many turns.
        """
        start, stop = self._lane_ranges
        parts = self._parts_per_group
        number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        begin, length, parts_of = (np.repeat(a, parts) for a in (start, stop - start, parts))
        bounds = [begin + length * k // parts_of for k in (number, number + 1)]
        scale = np.repeat(np.tile(1.0 / np.diff(self.first), self.samples), parts)
        arrays = (
            own_memory(bounds[0], mi.UInt32),
            own_memory(bounds[1], mi.UInt32),
            own_memory(scale, mi.Float),
        )
        dr.eval(arrays)
        return arrays

    def add_parts(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Sums over the kernel lanes of each group in each sample, along the first axis: (samples, g, ...).

        `values` are used up. Neighbours are added pair by pair, for a group may have a hundred parts.
        """
        for into, further in self._parts_to_add:
            values[into] += values[further]
        if len(values) > self.samples * len(self):
            parts = self._parts_per_group
            values = values[np.cumsum(parts) - parts]
        return values.reshape(self.samples, len(self), *values.shape[1:])

    @cached_property
    def _parts_to_add(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Which parts to add to which, one step after another, until the first of each group holds their sum."""
        parts = self._parts_per_group
        place = np.arange(parts.sum())
        number = place - np.repeat(np.cumsum(parts) - parts, parts)
        left = np.repeat(parts, parts) - number
        steps, apart = [], 1
        while apart < parts.max():
            into = place[(number % (2 * apart) == 0) & (left > apart)]
            steps.append((into, into + apart))
            apart *= 2
        return steps

    def mean_of_pixels(self, rows: NDArray[np.float32]) -> NDArray[np.float32]:
        """Means of rows (p, ...), one for each covered pixel of the recording, over each group: (g, ...)."""
        sums = np.add.reduceat(rows[self.member], self.first[:-1], axis=0, dtype=np.float64)
        count = np.diff(self.first).reshape(-1, *[1] * (rows.ndim - 1))
        return (sums / count).astype(np.float32)

    def average(self, image: Pixels) -> NDArray[np.float32]:
        """Mean of `image` (height, width, 3) over the pixels of each group, shape (g, 3)."""
        flat = image.reshape(-1, image.shape[-1])[self.pixels]
        count = np.diff(self.first)
        if len(flat) == len(self):
            return flat
        sums = np.add.reduceat(flat.astype(np.float64), self.first[:-1], axis=0)
        return (sums / count[:, None]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class ReturnedLight:
    """What a recording's lanes have of light that the target itself has reflected before.

    Attributes
    ----------
    weight
        That part of each lane's weight.
    order
        How often it was reflected in the mean, (3,), weighed by radiance, for each channel.
    share
        The part of all lanes' weight that it is, (3,).
    """

    weight: mi.Color3f
    order: NDArray[np.float64]
    share: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RecordedPaths:
    """All lanes of one recording, ordered by tile, then pixel.

    Attributes
    ----------
    wi, wo
        Unit directions to the camera and to the light in the shading frame; the target's own light has none, (0, 0, 0).
    weight
        Incident radiance x visibility x multiple importance weight / density x pixel filter, linear Rec.709.
    pixel, tile
        Flat index of each covered pixel (row * width + column) and the number of its tile.
    first
        Lanes of covered pixel p in sample s are `first[s, p]` to `first[s, p + 1]`; shape (samples, p + 1). Each sample
        has the light of every pixel, along the same camera rays but with random numbers of its own.
    coverage
        Share of each covered pixel's filter weight that lies on the target.
    constant
        What does not depend on the target's BSDF at the first hit, (height, width, 3): background and other objects
        seen in covered pixels, the target's own light unless lanes have it, of a mix what its held materials show; 0
        elsewhere.
    constant_difference
        Half the difference of two samples of `constant`; None where it has no noise of the light.
    returned
        Light that the target has reflected before; None where lanes have none or hold it as known.
    vector
        The values that were free, as they were for this light.
    held
        Values that a texture gives the material, by name: one number or colour for each lane.
    """

    wi: mi.Vector3f
    wo: mi.Vector3f
    weight: mi.Color3f
    pixel: NDArray[np.int64]
    tile: NDArray[np.int64]
    first: NDArray[np.int64]
    coverage: NDArray[np.float32]
    constant: Pixels
    held: Mapping[str, Any] = field(default_factory=dict)
    constant_difference: Pixels | None = None
    returned: ReturnedLight | None = None
    vector: NDArray[np.float64] | None = None

    @property
    def lanes(self) -> int:
        """Number of recorded lanes."""
        return int(self.first[-1, -1])

    @property
    def bytes(self) -> int:
        """Memory of the lanes."""
        floats = sum(1 if isinstance(value, (mi.Float, mi.UInt32)) else 3 for value in self.held.values())
        return self.lanes * (BYTES_PER_LANE + 4 * floats + (0 if self.returned is None else BYTES_OF_RETURNED))

    @property
    def interior(self) -> NDArray[np.bool_]:
        """Covered pixels without background in them."""
        return self.coverage > 0.999

    def constant_of(self, groups: LaneGroups) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """The part of the image of the groups that no value changes, and half the difference of two samples of it."""
        apart = self.constant_difference
        return groups.average(self.constant), None if apart is None else groups.average(apart)

    def pixel_groups(self, keep: NDArray[np.bool_] | None = None) -> LaneGroups:
        """One group for each covered pixel, or for those in `keep`."""
        member = np.arange(len(self.pixel)) if keep is None else np.flatnonzero(keep)
        return LaneGroups(member, np.arange(len(member) + 1), self.pixel[member], self.first)

    def tile_groups(self, keep: NDArray[np.bool_] | None = None, side: int = TILE) -> LaneGroups:
        """One group for each tile with a covered pixel, or for those whose covered pixels are all in `keep`.

        With a `side` of half a tile's it is one for each of its quarters.
        """
        if side not in (TILE, TILE // 2):
            raise ValueError(f"side is {side}: give {TILE} or {TILE // 2} pixels.")
        number = self.tile if side == TILE else 4 * self.tile + quarter(self.pixel, self.constant.shape[1])
        begin = np.flatnonzero(np.diff(number, prepend=-1))
        first = np.append(begin, len(number))
        groups = LaneGroups(np.arange(len(self.pixel)), first, self.pixel, self.first)
        return groups if keep is None else groups.take(np.flatnonzero(np.logical_and.reduceat(keep, begin)))
