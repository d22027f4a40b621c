# SPDX-License-Identifier: Apache-2.0
"""Noisy pictures compared as an eye sees them: compressed pixels of as many samples as the reference has.

Under small bright lights few paths carry much of the light, and sums of squares see little else. A compressed pixel
does not care how bright a firefly is, but its mean depends on how many samples it has: few are darker than many. So
the model's pixels are made of as many samples as the reference's, and what the compression takes away from both
cancels (D. McFadden, "A Method of Simulated Moments", 1989).

*How many samples* the noise tells. Of two pictures of n samples, the reference differs from one, between neighbouring
pixels, as the other does, if n is its own count. Differences are of strongly compressed pixels and count by their
absolute values, so that no firefly decides.

*The recount.* The count that a fit compares with is a whole number, found where the model was still off. At the end
the noise tells it better, and how well. An error of the count is one of the brightness, which the scatter of the
residuals does not hold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...metrics.pixels.neighbours import neighbour_pairs, sums_around
from ...types.image import Pixels
from ...types.parameter import Vector
from ..tolerances import DIM_FLOOR

Values = NDArray[np.floating]
Shape = tuple[int, ...]
# (samples a pixel, stream of random numbers) -> two independent pictures (2, p, 3), scene-linear
TwoPictures = Callable[[int, int], NDArray[np.float32]]

LEVEL = 0.25  # of the median: below, compressed values are about linear
MOST_COUNT = 64  # samples a pixel; more take too long, and there is less to compress
ALIKE = 0.2  # logarithm: with so much more noise at the most samples these are taken
LOUD = 0.25  # relative variance of a pixel's radiance; for a calmer reference plain squares do, in half the time
COUNT_REACH = 3  # pixels to each side that noise is averaged over
COUNT_LEVEL = 0.1  # of `LEVEL`, for the count: counts of glass' pictures are off by 7 % with it, and by 9 % without
GROUPS = 24  # of pixels, whose scatter tells how well the noise is known
LEAST_SLOPE = 0.05  # of the excess by the logarithm of the count: below, noise hardly tells it
CURVED = 0.03  # of the logarithm: the excess is not quite a straight line
FURTHEST = float(np.log(2.0))  # a straight line from n to 2 n samples holds no further
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
    total, count = _around(model, pixels, shape)
    level = (total / np.maximum(count, 1.0)[..., None]).reshape(-1, 3)[pixels] + DIM_FLOOR * float(model.mean())
    residual = (seen - model) / np.maximum(level, 1e-30)
    here, there = neighbour_pairs(pixels, shape)
    return float(np.mean(np.square(residual[here] - residual[there]))) / 3.0 if len(here) else 0.0


def _local_noise(variance: Vector, pixels: NDArray[np.int64], shape: Shape) -> Pixels:
    """Variances (p, 3) averaged with those around them, and nowhere near 0: (height, width, 3)."""
    mean = variance.mean(axis=0)
    total, count = _around(variance, pixels, shape)
    return ((total + PRIOR * mean) / (count + PRIOR)[..., None] + FLOOR * mean).astype(np.float32)


def _around(values: Vector, pixels: NDArray[np.int64], shape: Shape) -> tuple[Vector, Vector]:
    """Sums (height, width, n) of the values (p, n) of pixels around each one, and how many have values there."""
    inside, shown = np.zeros(shape), np.zeros((*shape, values.shape[1]))
    inside.ravel()[pixels], shown.reshape(-1, values.shape[1])[pixels] = 1.0, values
    return sums_around(shown, COUNT_REACH), sums_around(inside, COUNT_REACH)


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
        self._level, self._top = COUNT_LEVEL * level, top
        self._seen = self._compressed(reference.reshape(-1, 3)[pixels])
        self._here, self._there = neighbour_pairs(pixels, shape)
        self._group = self._here * GROUPS // len(pixels)

    def excess(self, pictures: Values) -> NoiseExcess:
        """By independent linear pictures (2 m, p, 3)."""
        model = self._compressed(pictures)
        own = self._roughness(model[::2] - model[1::2])
        others = self._roughness(self._seen - model)
        influence = own / max(own.sum(), 1e-30) - others / max(others.sum(), 1e-30)
        variance = GROUPS / (GROUPS - 1) * float(np.sum(np.square(influence - influence.mean())))
        return NoiseExcess(float(np.log(max(own.sum(), 1e-30) / max(others.sum(), 1e-30))), variance)

    def _compressed(self, radiance: Values) -> Values:
        return np.log1p(np.clip(radiance, 0.0, self._top) / self._level)

    def _roughness(self, residuals: Values) -> NDArray[np.float64]:
        """Sums (g,) of differences of residuals (m, p, 3) in pixels next to each other, the mean of the m."""
        steps = np.abs(residuals[:, self._here] - residuals[:, self._there]).sum(axis=2).mean(axis=0)
        return np.bincount(self._group, steps, GROUPS).astype(np.float64)


@dataclass(frozen=True)
class Recount:
    """What the noise says about the count at the end of a fit.

    Attributes
    ----------
    log_ratio, sd
        Natural logarithm of the reference's count over the one that was compared with, `FURTHEST` away at most, and its
        standard deviation, which holds what is further away.
    slope
        Derivative of the mean of compressed pixels (p, 3) by that logarithm.
    """

    log_ratio: float
    sd: float
    slope: Vector = field(repr=False)


def recount(counts: EqualCounts, comparison: NoiseComparison, pictures: TwoPictures) -> Recount:
    """Count the samples of the reference again by four linear `pictures` of the model at the end."""
    once = np.concatenate([pictures(counts.count, stream) for stream in range(2)])
    twice = 0.5 * (once[::2] + once[1::2])
    here, further = comparison.excess(once), comparison.excess(twice)
    steepness = max((here.logarithm - further.logarithm) / np.log(2.0), LEAST_SLOPE)
    ratio = here.logarithm / steepness
    followed = float(np.clip(ratio, -FURTHEST, FURTHEST))
    sd = float(np.linalg.norm([np.sqrt(here.variance) / steepness, CURVED, ratio - followed]))
    means = [counts.compress(y[..., None])[..., 0].mean(axis=0, dtype=np.float64) for y in (once, twice)]
    return Recount(followed, sd, (means[1] - means[0]) / np.log(2.0))
