# SPDX-License-Identifier: Apache-2.0
"""How much noisier a model's pictures are than a reference.

Of two pictures of n samples, a reference differs from one, between neighbouring pixels, as the other does if n is its
own count. Differences are of strongly compressed pixels and count by their absolute values, so that no firefly decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..judge.neighbours import neighbour_pairs

FINER = 0.1  # of the level that pictures are compared at: counts of glass' pictures are off by 7 instead of 9 %
GROUPS = 24  # of pixels, whose scatter tells how well the noise is known
LEAST = 1e-30

Values = NDArray[np.floating]


@dataclass(frozen=True)
class NoiseExcess:
    """Natural logarithm of the model's noise over the reference's, and the variance of that."""

    logarithm: float
    variance: float


class NoiseComparison:
    """Compares pictures of the pixels with these flat indices in a picture of `shape` with a linear `reference`.

    Pixels that follow each other should lie near each other. `level` and `top` are those of `EqualCounts`.
    """

    def __init__(
        self, reference: Values, pixels: NDArray[np.int64], shape: tuple[int, ...], level: float, top: float
    ) -> None:
        self._level, self._top = FINER * level, top
        self._seen = self._compressed(reference.reshape(-1, 3)[pixels])
        self._here, self._there = neighbour_pairs(pixels, shape)
        self._group = self._here * GROUPS // len(pixels)

    def excess(self, pictures: Values) -> NoiseExcess:
        """By independent linear pictures (2 m, p, 3)."""
        model = self._compressed(pictures)
        own = self._roughness(model[::2] - model[1::2])
        others = self._roughness(self._seen - model)
        influence = own / max(own.sum(), LEAST) - others / max(others.sum(), LEAST)
        variance = GROUPS / (GROUPS - 1) * float(np.sum(np.square(influence - influence.mean())))
        return NoiseExcess(float(np.log(max(own.sum(), LEAST) / max(others.sum(), LEAST))), variance)

    def _compressed(self, radiance: Values) -> Values:
        return np.log1p(np.clip(radiance, 0.0, self._top) / self._level)

    def _roughness(self, residuals: Values) -> NDArray[np.float64]:
        """Sums (g,) of differences of residuals (m, p, 3) in pixels next to each other, the mean of the m."""
        steps = np.abs(residuals[:, self._here] - residuals[:, self._there]).sum(axis=2).mean(axis=0)
        return np.bincount(self._group, steps, GROUPS).astype(np.float64)
