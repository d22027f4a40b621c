# SPDX-License-Identifier: Apache-2.0
"""How noisy a reference is, tile by tile, from what a model of it leaves unexplained.

Neighbouring pixels see nearly the same material under nearly the same light, so a misfit cancels in the difference of
their residuals and independent noise does not: half its square is the noise's variance (J. von Neumann, "Distribution
of the Ratio of the Mean Square Successive Difference to the Variance", 1941). A tile's variance comes from the tiles
around it, never from the tile itself: a weight that knows the noise it weighs would pull every result to the dark.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...metrics.flip.block_means import block_sums
from ...metrics.pixels.neighbours import next_to, sums_around
from ...render.camera.primary_rays import TILE
from ...render.paths.recorded_paths import LaneGroups, RecordedPaths
from ...types.image import Pixels
from ..tolerances import DIM_FLOOR

VARIANCE_REACH = 8  # pixels to each side of a tile that its variance is taken from
PRIOR_PAIRS = 8  # pairs of pixels that the variance of the whole picture counts for
SKEW = 1.5  # mean over median of the tiles' variances under path tracing's skewed noise, about


@dataclass(frozen=True)
class TileNoise:
    """Standard deviation of each group's mean (g, 3), in radiance, and of a pixel relative to its radiance."""

    deviation: NDArray[np.float64]
    level: float

    def take(self, chosen: NDArray[np.int64]) -> TileNoise:
        """That of the groups of these numbers."""
        return TileNoise(self.deviation[chosen], self.level)


def tile_noise(
    reference: Pixels,
    model: NDArray[np.float32],
    paths: RecordedPaths,
    groups: LaneGroups,
    keep: NDArray[np.bool_],
    side: int = TILE,
) -> TileNoise:
    """Noise of the linear `reference` (height, width, 3) in `groups`, tiles of this `side`, given the model's pixels.

    `model` (p, 3) has a row for each pixel of the recording; only pixels in `keep` (p,) are compared, or all where that
    is none: of what lets light through everywhere. The recording's own noise is part of the answer, as it is of the
    residual.
    """
    keep = keep if keep.any() else np.ones_like(keep)
    width = reference.shape[1]
    pixels = np.divmod(paths.pixel, width)  # rows and columns
    step = max(int(np.gcd.reduce(np.concatenate([np.diff(np.unique(n // side)) for n in pixels]))), 1)
    lines = [_Lines.of(n, side, step) for n in pixels]
    at = tuple(line.number[n] for line, n in zip(lines, pixels, strict=True))
    shape = tuple(len(line.index) for line in lines)
    inside, shown = np.zeros((*shape, 1), bool), np.zeros((*shape, 3))
    inside[at] = keep[:, None]
    shown[at] = model * keep[:, None]
    rows, columns = (np.minimum(line.index, n - 1) for line, n in zip(lines, reference.shape[:2], strict=True))
    reference = np.where(inside, reference[np.ix_(rows, columns)], np.float32(0.0))
    level = block_sums(shown, side) / np.maximum(block_sums(inside, side), 1) + DIM_FLOOR * max(
        float(reference[inside[..., 0]].mean()), 1e-12
    )
    residual = (reference - shown) / np.repeat(np.repeat(level, side, 0), side, 1)

    squares, pairs = np.zeros_like(residual), np.zeros((*shape, 1))
    for axis in (0, 1):
        here, there = next_to(axis)
        both = inside[here] & inside[there] & lines[axis].followed(axis)
        squares[here] += 0.5 * np.square(residual[here] - residual[there]) * both
        pairs[here] += both
    squares, pairs = block_sums(squares, side), block_sums(pairs, side)
    counted = pairs[..., 0] > 0
    if not counted.any():
        return TileNoise(np.ones((len(groups), 3)), 0.0)
    typical = SKEW * np.median(squares[counted] / pairs[counted], axis=0)  # which one firefly cannot move
    reach = VARIANCE_REACH // (side * step)
    variance = (_around(squares, reach) + PRIOR_PAIRS * typical) / (_around(pairs, reach) + PRIOR_PAIRS)

    first = np.divmod(groups.pixels[groups.first[:-1]], width)
    tile = tuple(line.number[index] // side for line, index in zip(lines, first, strict=True))
    deviation = np.sqrt(variance[tile] / np.diff(groups.first)[:, None]) * level[tile]
    return TileNoise(deviation, float(np.sqrt(np.mean(variance[counted]))))


@dataclass(frozen=True)
class _Lines:
    """Rows, or columns, of the tiles that a recording has: of every tile, or of every second, third, ... one.

    `index` holds their numbers in the picture, `number` the way back.
    """

    index: NDArray[np.int64]
    number: NDArray[np.int64]

    @classmethod
    def of(cls, lines: NDArray[np.int64], side: int, step: int) -> _Lines:
        """Those of every `step`-th tile between the first and the last of recorded pixels in these lines."""
        tiles = np.arange(lines.min() // side, lines.max() // side + 1, step)
        index = (tiles[:, None] * side + np.arange(side)).ravel()
        number = np.zeros(index[-1] + 1, np.int64)
        number[index] = np.arange(len(index))
        return cls(index, number)

    def followed(self, axis: int) -> NDArray[np.bool_]:
        """Whether the next line is the next one of the picture, too; for arrays that have the lines along `axis`."""
        return np.expand_dims(np.diff(self.index) == 1, tuple(a for a in range(3) if a != axis))


def _around(tiles: NDArray, reach: int) -> NDArray[np.float64]:
    """Sums over the neighbours of each tile, without the tile itself."""
    return sums_around(tiles, reach) - tiles
