# SPDX-License-Identifier: Apache-2.0
"""LDR-FLIP against one picture, tile by tile: the reference's side is computed once, equal tiles cost nothing.

FLIP's filters reach a few pixels, so a tile with that margin around it gives the same errors as the whole picture.
Tiles also keep all intermediate planes in the processor's cache, which is worth more than the margins cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .flip_difference import FlipDifference
from .flip_features import FlipFeatures, Perceived
from .flip_filters import DEFAULT_PIXELS_PER_DEGREE, flip_filters, flip_reach

Array = NDArray[np.floating]
_Box = tuple[slice, slice]

TILE = 128


@dataclass(frozen=True)
class _Tile:
    """The pixels a tile answers for (`inner`), those it reads (`outer`), and where the former lie in the latter."""

    inner: _Box
    outer: _Box
    inner_of_outer: _Box


class FlipReference:
    """One side of LDR-FLIP.

    Parameters
    ----------
    planes
        Linear light of the display, (3, height, width) in [0, 1]; its type is that of all results.
    pixels_per_degree
        How large the picture is seen.
    """

    def __init__(self, planes: Array, pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE) -> None:
        self._planes = planes
        self._pixels_per_degree = pixels_per_degree
        self._tiles = _tiles(planes.shape[1], planes.shape[2], flip_reach(pixels_per_degree))
        self._perceived: dict[int, Perceived] = {}

    def compare(self, planes: Array) -> FlipComparison:
        """The errors of other planes of the same size and type."""
        differences = []
        for index, tile in enumerate(self._tiles):
            reference, test = self._planes[:, tile.outer[0], tile.outer[1]], planes[:, tile.outer[0], tile.outer[1]]
            if not np.array_equal(reference, test):
                if index not in self._perceived:
                    self._perceived[index] = self._features(reference).perceived
                differences.append((tile, FlipDifference(self._perceived[index], self._features(test))))
        return FlipComparison(differences, planes.shape, planes.dtype)

    def _features(self, planes: Array) -> FlipFeatures:
        planes = np.ascontiguousarray(planes)
        return FlipFeatures(planes, flip_filters(*planes.shape[1:], self._pixels_per_degree, planes.dtype))


class FlipComparison:
    """The map of one comparison: `error` (height, width) in [0, 1], exactly 0 where both pictures are equal around."""

    def __init__(
        self, differences: list[tuple[_Tile, FlipDifference]], shape: tuple[int, ...], dtype: np.dtype
    ) -> None:
        self._differences = differences
        self._shape = shape
        self.error = np.zeros(shape[1:], dtype)
        for tile, difference in differences:
            self.error[tile.inner] = difference.error[tile.inner_of_outer]

    def pullback(self, weight: Array) -> Array:
        """Gradient of sum(weight * error) with respect to the test planes, (3, height, width)."""
        gradient = np.zeros(self._shape, self.error.dtype)
        for tile, difference in self._differences:
            if weight[tile.inner].any():
                padded = np.zeros_like(difference.error)
                padded[tile.inner_of_outer] = weight[tile.inner]
                gradient[:, tile.outer[0], tile.outer[1]] += difference.pullback(padded)
        return gradient


def _tiles(height: int, width: int, reach: int) -> list[_Tile]:
    tiles = []
    for inner_y, outer_y, local_y in _spans(height, reach):
        for inner_x, outer_x, local_x in _spans(width, reach):
            tiles.append(_Tile((inner_y, inner_x), (outer_y, outer_x), (local_y, local_x)))
    return tiles


def _spans(length: int, reach: int) -> list[tuple[slice, slice, slice]]:
    edges = np.linspace(0, length, max(1, round(length / TILE)) + 1).astype(int)
    spans = []
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        outer = slice(max(0, start - reach), min(length, stop + reach))
        spans.append((slice(start, stop), outer, slice(start - outer.start, stop - outer.start)))
    return spans
