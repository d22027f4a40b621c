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

from ..render.primary_rays import TILE
from ..render.recorded_paths import LaneGroups, RecordedPaths
from ..types.image import Pixels
from .neighbours import next_to, sums_around

REACH = 8  # pixels to each side of a tile that its variance is taken from
PRIOR_PAIRS = 8  # pairs of pixels that the variance of the whole picture counts for
SKEW = 1.5  # mean over median of the tiles' variances under path tracing's skewed noise, about
DARK = 0.1  # share of the mean below which noise no longer shrinks with the radiance


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

    `model` (p, 3) has a row for each pixel of the recording; only pixels in `keep` (p,) are compared. The recording's
    own noise is part of the answer, as it is of the residual.
    """
    height, width = reference.shape[:2]
    inside = np.zeros(height * width, bool)
    inside[paths.pixel[keep]] = True
    shown = np.zeros((height * width, 3))
    shown[paths.pixel] = model
    inside, shown = inside.reshape(height, width, 1), shown.reshape(height, width, 3) * inside.reshape(height, width, 1)
    level = _tiles(shown, side) / np.maximum(_tiles(inside, side), 1) + DARK * max(
        float(reference[inside[..., 0]].mean()), 1e-12
    )
    residual = (reference - shown) * inside / np.repeat(np.repeat(level, side, 0), side, 1)[:height, :width]

    squares, pairs = np.zeros_like(residual), np.zeros((height, width, 1))
    for axis in (0, 1):
        here, there = next_to(axis)
        both = inside[here] & inside[there]
        squares[here] += 0.5 * np.square(residual[here] - residual[there]) * both
        pairs[here] += both
    squares, pairs = _tiles(squares, side), _tiles(pairs, side)
    counted = pairs[..., 0] > 0
    if not counted.any():
        return TileNoise(np.ones((len(groups), 3)), 0.0)
    typical = SKEW * np.median(squares[counted] / pairs[counted], axis=0)  # which one firefly cannot move
    reach = REACH // side
    variance = (_around(squares, reach) + PRIOR_PAIRS * typical) / (_around(pairs, reach) + PRIOR_PAIRS)

    row, column = np.divmod(groups.pixels[groups.first[:-1]], width)
    at = row // side, column // side
    deviation = np.sqrt(variance[at] / np.diff(groups.first)[:, None]) * level[at]
    return TileNoise(deviation, float(np.sqrt(np.mean(variance[counted]))))


def _tiles(pixels: NDArray, side: int) -> NDArray[np.float64]:
    """Sums over tiles of an image (height, width, channels)."""
    height, width, channels = pixels.shape
    rows, columns = -(-height // side), -(-width // side)
    padded = np.zeros((rows * side, columns * side, channels))
    padded[:height, :width] = pixels
    return padded.reshape(rows, side, columns, side, channels).sum((1, 3))


def _around(tiles: NDArray, reach: int) -> NDArray[np.float64]:
    """Sums over the neighbours of each tile, without the tile itself."""
    return sums_around(tiles, reach) - tiles
