# SPDX-License-Identifier: Apache-2.0
"""LDR-FLIP against one picture, tile by tile: the reference's side is computed once, equal tiles cost nothing.

FLIP's filters reach a few pixels, so a tile with that margin around it gives the same errors as the whole picture.
Tiles also keep all intermediate planes in the processor's cache, which is worth more than the margins cost, and several
processors share a picture by them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..pixels.side_by_side import side_by_side
from .flip_difference import FlipDifference
from .flip_features import FlipFeatures, Perceived
from .flip_filters import DEFAULT_PIXELS_PER_DEGREE, flip_filters, flip_reach

Array = NDArray[np.floating]
_Box = tuple[slice, slice]

# Smaller ones have more margin and, on two processors, more turns at Python's lock: 128 x 128 takes 1.2 times as long
# on one and 1.3 times on two (256 x 256, HDR-FLIP); 256 x 256 leaves one of them idle.
TILE_HEIGHT, TILE_WIDTH = 128, 256


@dataclass(frozen=True, eq=False)
class Tile:
    """The pixels a tile answers for (`inner`), those it reads (`outer`), and where the former lie in the latter."""

    inner: _Box
    outer: _Box
    inner_of_outer: _Box


def _as_it_is(planes: Array) -> Array:
    return planes


class FlipReference:
    """One side of LDR-FLIP.

    Parameters
    ----------
    planes
        The picture, (3, height, width); its type is that of all results.
    pixels_per_degree
        How large the picture is seen.
    shown
        Makes linear light of the display in [0, 1] of planes, pixel by pixel; by default they are that.
    """

    def __init__(
        self,
        planes: Array,
        pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE,
        shown: Callable[[Array], Array] = _as_it_is,
    ) -> None:
        self._planes = planes
        self._pixels_per_degree = pixels_per_degree
        self._shown = shown
        self.tiles = _tiles(planes.shape[1], planes.shape[2], flip_reach(pixels_per_degree))
        self._light: dict[Tile, Array] = {}
        self._perceived: dict[Tile, Perceived] = {}

    def compare(self, planes: Array) -> FlipComparison:
        """The errors of other planes of the same size and type, by this thread alone."""
        return _joined(self.tiles, (self.difference(tile, planes) for tile in self.tiles), planes)

    def difference(self, tile: Tile, planes: Array) -> FlipDifference | None:
        """The errors of one tile of other planes; None where both are shown alike."""
        if tile not in self._light:
            self._light[tile] = self._light_of(self._planes, tile)
        reference, test = self._light[tile], self._light_of(planes, tile)
        if np.array_equal(reference, test):
            return None
        if tile not in self._perceived:
            self._perceived[tile] = self._features(reference).perceived
        return FlipDifference(self._perceived[tile], self._features(test))

    def _light_of(self, planes: Array, tile: Tile) -> Array:
        return self._shown(planes[:, tile.outer[0], tile.outer[1]])

    def _features(self, light: Array) -> FlipFeatures:
        light = np.ascontiguousarray(light)
        return FlipFeatures(light, flip_filters(*light.shape[1:], self._pixels_per_degree, light.dtype))


def comparisons(references: Sequence[FlipReference], planes: Array) -> Iterator[FlipComparison]:
    """`planes` against each of several references of one size, all their tiles side by side."""
    work = [(reference, tile) for reference in references for tile in reference.tiles]
    differences = side_by_side(lambda item: item[0].difference(item[1], planes), work)
    for reference in references:
        yield _joined(reference.tiles, islice(differences, len(reference.tiles)), planes)


def _joined(tiles: Sequence[Tile], differences: Iterable[FlipDifference | None], planes: Array) -> FlipComparison:
    pairs = zip(tiles, differences, strict=True)
    compared = [(tile, difference) for tile, difference in pairs if difference is not None]
    return FlipComparison(compared, planes.shape, planes.dtype)


class FlipComparison:
    """The map of one comparison: `error` (height, width) in [0, 1], exactly 0 where both pictures are equal around."""

    def __init__(self, differences: list[tuple[Tile, FlipDifference]], shape: tuple[int, ...], dtype: np.dtype) -> None:
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


def _tiles(height: int, width: int, reach: int) -> list[Tile]:
    tiles = []
    for inner_y, outer_y, local_y in _spans(height, TILE_HEIGHT, reach):
        for inner_x, outer_x, local_x in _spans(width, TILE_WIDTH, reach):
            tiles.append(Tile((inner_y, inner_x), (outer_y, outer_x), (local_y, local_x)))
    return tiles


def _spans(length: int, size: int, reach: int) -> list[tuple[slice, slice, slice]]:
    edges = np.linspace(0, length, max(1, round(length / size)) + 1).astype(int)
    spans = []
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        outer = slice(max(0, start - reach), min(length, stop + reach))
        spans.append((slice(start, stop), outer, slice(start - outer.start, stop - outer.start)))
    return spans
