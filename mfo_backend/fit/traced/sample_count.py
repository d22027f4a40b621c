# SPDX-License-Identifier: Apache-2.0
"""Noisy pictures compared as an eye sees them: compressed pixels of as many samples as the reference has.

Under small bright lights few paths carry much of the light, and sums of squares see little else. A compressed pixel
does not care how bright a firefly is, but its mean depends on how many samples it has: few are darker than many. So
the model's pixels are made of as many samples as the reference's, and what the compression takes away from both
cancels (D. McFadden, "A Method of Simulated Moments", 1989). How many those are the noise tells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels
from ..judge.neighbours import neighbour_pairs, sums_around
from .noise_excess import NoiseComparison

Vector = NDArray[np.float64]
Shape = tuple[int, ...]
# (samples a pixel, stream of random numbers) -> two independent pictures (2, p, 3), scene-linear
TwoPictures = Callable[[int, int], NDArray[np.float32]]

LEVEL = 0.25  # of the median: below, compressed values are about linear
MOST_COUNT = 64  # samples a pixel; more take too long, and there is less to compress
ALIKE = 0.2  # logarithm: with so much more noise at the most samples these are taken
LOUD = 0.25  # relative variance of a pixel's radiance; for a calmer reference plain squares do, in half the time
REACH = 3  # pixels to each side that noise is averaged over
PRIOR, FLOOR = 8.0, 0.2  # pixels that the whole picture's noise counts for, and the part of it that is everywhere


@dataclass(frozen=True)
class EqualCounts:
    """How a noisy reference is compared.

    Attributes
    ----------
    reference, noise
        Compressed values of the reference, and the variance of a pixel's, both (height, width, 3).
    level, top
        Compressed is log(1 + y / level); radiance above `top`, which a display cannot show, counts as that.
    count
        Samples a pixel of the pictures to compare with it.
    """

    reference: Pixels = field(repr=False)
    noise: Pixels = field(repr=False)
    level: float
    top: float
    count: int

    def compress(self, table: NDArray[np.float32]) -> NDArray[np.float32]:
        """Compressed values and their derivatives from those of radiance (..., 1 + k)."""
        return compressed(table, self.level, self.top)

    @property
    def mean_noise(self) -> float:
        """Mean variance of a compressed pixel; where nothing was looked at it is that of what was."""
        return float(self.noise.mean())


def compressed(table: NDArray[np.float32], level: float, top: float) -> NDArray[np.float32]:
    """log(1 + y / level) of the first entries of the last axis, and the derivatives that follow them."""
    value = np.clip(table[..., :1], 0.0, top)
    slope = np.where(table[..., :1] < top, 1.0 / (level + value), 0.0)
    return np.concatenate([np.log1p(value / level), slope * table[..., 1:]], axis=-1).astype(np.float32)


def equal_counts(
    reference: Pixels,
    mask: NDArray[np.bool_],
    pixels: NDArray[np.int64],
    clipped: Pixels | None,
    pictures: TwoPictures,
) -> EqualCounts | None:
    """How to compare with a noisy linear `reference` (height, width, 3); None where it is clean, or has more samples.

    `pictures` are a model's, of the pixels with the flat indices `pixels`. At equal counts the reference differs from
    one of them as another does. Differences are compared between neighbouring pixels, where a misfit cancels in part;
    where the model is far off the count is too low.
    """
    seen = reference[mask]
    level = LEVEL * float(np.median(seen))
    if level <= 0.0:
        return None
    top = np.inf if clipped is None or not clipped[mask].any() else float(seen[clipped[mask] > 0].min())
    comparison = NoiseComparison(reference, pixels, mask.shape, level, top)
    halves = np.zeros((2, len(pixels), 3))
    count, before, excess = 0, np.inf, np.inf
    while excess > 0.0 and count < MOST_COUNT:
        more = max(count, 1)
        halves = (count * halves + more * pictures(more, count)) / (count + more)
        count += more
        before, excess = excess, comparison.excess(halves).logarithm
    if excess > ALIKE or _relative_variance(reference.reshape(-1, 3)[pixels], halves, pixels, mask.shape) < LOUD:
        return None
    if excess < 0.0 < before < np.inf:
        # the excess falls about evenly with the logarithm of the count
        count = max(round(count * 2.0 ** (excess / (before - excess))), 1)
    target, first, second = (compressed(y[..., None], level, top)[..., 0] for y in (reference, *halves))
    noise = _local_noise(0.5 * np.square(first - second), pixels, mask.shape)
    return EqualCounts(target, noise, level, top, count)


def _relative_variance(seen: NDArray[np.float32], halves: Vector, pixels: NDArray[np.int64], shape: Shape) -> float:
    """Variance of the reference `seen` (p, 3), relative to the model's radiance around and a tenth of its mean.

    From residuals of neighbours, as a misfit cancels there in part: the reference's noise and half of the model's.
    """
    model = halves.mean(axis=0)
    inside, shown = _in_picture(model, pixels, shape)
    total, count = (sums_around(picture, REACH) for picture in (shown, inside.astype(np.float64)))
    level = (total / np.maximum(count, 1.0)[..., None]).reshape(-1, 3)[pixels] + 0.1 * float(model.mean())
    residual = (seen - model) / np.maximum(level, 1e-30)
    here, there = neighbour_pairs(pixels, shape)
    return float(np.mean(np.square(residual[here] - residual[there]))) / 3.0 if len(here) else 0.0


def _local_noise(variance: Vector, pixels: NDArray[np.int64], shape: Shape) -> Pixels:
    """Variances (p, 3) averaged with those around them, and nowhere near 0: (height, width, 3)."""
    inside, shown = _in_picture(variance, pixels, shape)
    mean = variance.mean(axis=0)
    total, count = (sums_around(picture, REACH) for picture in (shown, inside.astype(np.float64)))
    return ((total + PRIOR * mean) / (count + PRIOR)[..., None] + FLOOR * mean).astype(np.float32)


def _in_picture(
    values: Vector, pixels: NDArray[np.int64], shape: Shape
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which pixels (height, width) have values (p, n), and these (height, width, n), 0 elsewhere."""
    inside, shown = np.zeros(shape, bool), np.zeros((*shape, values.shape[1]))
    inside.ravel()[pixels], shown.reshape(-1, values.shape[1])[pixels] = True, values
    return inside, shown
