# SPDX-License-Identifier: Apache-2.0
"""How much of the difference of two pictures noise does not explain.

Noise of path-traced pictures is independent from pixel to pixel, whatever its size and its tails, so products of the
differences of near pixels have the mean 0; what renderers, scenes and materials differ in is wider than a pixel and
adds its square. Flipping the sign of each pixel's difference is as likely as not under noise alone, so the root of the
sum of the products' squares is the standard deviation of their sum.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.colour import srgb_from_linear
from ...metrics.flip.flip_filters import DEFAULT_PIXELS_PER_DEGREE, flip_reach
from ...metrics.flip.ldr_flip import flip_map
from ...metrics.pixels.neighbours import sums_around
from ...types.verdict import Difference
from ..tolerances import CHANCE
from .region import blocks_around

# Pixels between two whose differences are multiplied. Those next to each other may share some of their noise: by
# compression, by resampling
APART = ((0, 2), (2, 0), (2, 2), (2, -2), (0, 3), (3, 0))
# The same of patterns of a few pixels, whose products change their sign with the distance, each pair of distances by
# itself. Silhouettes that two renderers filter differently show here, too
FINE = (((0, 1), (1, 0)), ((1, 1), (1, -1)), ((0, 2), (2, 0)), ((2, 2), (2, -2)))
# The same of means over blocks, which share nothing
NEXT = ((0, 1), (1, 0), (1, 1), (1, -1))
# Pixels: of what an eye is asked about, so that it does not look at noise. Nine tenths of independent noise go, and
# little of what few global values change
BLUR = 2.0
BLURRED_TOGETHER = 4.0 * math.pi * BLUR**2  # pixels that share their noise after that
NOISE_REACH = 4  # pixels to each side of one that its noise is taken from
LEAST_PIXELS = 40  # fewer say too little
# Below as many, noise is drawn from the pictures themselves, with their tails and colours: normal numbers of the same
# variance look larger, by up to 0.03 of FLIP in rooms of Cycles, and made errors of 0.02 look like 0.01 on targets of
# 360 to 420 pixels (docs/notebook/several_materials.md). Larger: also the targets that the limits were measured on.
FEW_PIXELS = 500
# What neighbours' noise adds to the variance of a mean, relative to it, at most. Under the Gaussian pixel filter of
# exported scenes, s = 0.4155 pixels, exp(-d^2 / 4 s^2) over eight neighbours is 1.16: half of that beside a reference
# of as much noise. More is taken for an error. Larger: fine errors count as noise. Smaller: noise counts as error.
FILTERED = 0.6
# Display values: a larger difference in light of two pixels counts as this much (docs/notebook/verdicts.md). Larger:
# rare bright pixels hide what others share. Smaller: noise with a long tail has a mean again.
MOST_APART = 0.5
LEAST_STEP = 1e-3  # of light: over which the slope of a display is taken. No measurement
DRAWS = 4  # whose mean is the noise of few pixels; of one, FLIP scattered by 0.005

Light = NDArray[np.floating]
Mask = NDArray[np.bool_]


def beyond_noise(
    reference: Light, result: Light, mask: Mask, lags: Sequence[tuple[int, int]] = APART
) -> Difference | None:
    """The difference over a mask of two pictures (height, width, 3) in linear light, 1 being a display's white.

    Values above 1 count in means of neighbours and are clipped afterwards. Both may hold noise. None for few pixels.
    """
    if np.count_nonzero(mask) < LEAST_PIXELS:
        return None
    near = blocks_around(mask, 1, flip_reach(DEFAULT_PIXELS_PER_DEGREE))  # all that counts, and what FLIP sees of it
    reference, result, mask = reference[near], result[near], mask[near]
    calm_reference, calm = (_blurred(light, mask) for light in (reference, result))
    shown = [displayed(light) for light in (calm_reference, calm)]
    seen = mean_flip(shown[0], shown[1], mask)
    apart = np.where(mask[..., None], reference - result, 0.0).astype(np.float64)
    variance = _noise_variance(apart, mask, lags)
    drawn = _of_few(apart, variance, mask, lags) if np.count_nonzero(mask) < FEW_PIXELS else _normal(apart, variance)
    noisy = [displayed(np.maximum(calm + _blurred(noise, mask), 0.0)) for noise in drawn]
    light = np.clip(apart * _slope(calm_reference, calm), -MOST_APART, MOST_APART)
    seen_light = np.where(mask[..., None], displayed(reference) - displayed(result), 0.0).astype(np.float64)
    shared, at_least = _beyond_chance(light, seen_light, mask, lags)
    fine = max(_beyond_chance(light, seen_light, mask, of, either=True)[1] for of in FINE)
    return Difference(
        seen,
        float(np.mean([mean_flip(shown[1], picture, mask) for picture in noisy])),
        shared,
        at_least,
        fine,
    )


def _beyond_chance(
    light: Light, displayed: Light, mask: Mask, lags: Sequence[tuple[int, int]], *, either: bool = False
) -> tuple[float, float]:
    """What near pixels share of differences, and at least, as display values.

    Those of `displayed` values scatter less, but noise gives them a mean. So they count where those of `light` are more
    than chance. With `either` their products may have the mean of either sign.
    """
    means, least = [], []
    for apart in (light, displayed):
        mean, deviation = _shared_square(apart, mask, lags)
        mean = abs(mean) if either else mean
        means.append(max(mean, 0.0) ** 0.5)
        least.append(max(mean - CHANCE * deviation, 0.0) ** 0.5)
    return (max(means), max(least)) if least[0] > 0.0 else (means[0], 0.0)


def _slope(first: Light, second: Light) -> NDArray[np.float64]:
    """What a display makes of a difference in light, between two calm pictures.

    A display bends and clips, so it shows noisy pixels darker in the mean than calm ones. Times this slope, which hangs
    on no pixel by itself, the mean of noise stays 0.
    """
    low, step = np.minimum(first, second), np.maximum(np.abs(first - second), LEAST_STEP)
    high = np.add(low, step, dtype=np.float64)
    return (displayed(high).astype(np.float64) - displayed(low)) / step


def _normal(apart: Light, variance: NDArray[np.float64]) -> Iterator[Light]:
    """Normal noise of this variance (height, width)."""
    yield np.sqrt(variance)[..., None] * np.random.default_rng(0).standard_normal(apart.shape)


def _of_few(
    apart: Light, variance: NDArray[np.float64], mask: Mask, lags: Sequence[tuple[int, int]]
) -> Iterator[Light]:
    """The differences themselves, scaled to this variance around each pixel, with signs that are drawn.

    What pixels side by side share beyond what those farther apart do is noise as well, as of a pixel filter that is
    wider than a pixel. Drawn signs lose it, so it is made up for in size: in a mean over neighbours it adds to the
    variance.
    """
    squares = sums_around(np.square(apart).mean(axis=-1) * mask, NOISE_REACH)
    around = squares / np.maximum(sums_around(mask.astype(np.float64), NOISE_REACH), 1.0)
    wide = max(_shared_square(apart, mask, lags)[0], 0.0)
    beside, across = (max(_shared_square(apart, mask, of)[0] - wide, 0.0) for of in FINE[:2])
    mean = max(float(variance[mask].mean()), 1e-30)
    more = 1.0 + min(4.0 * (beside + across) / mean, FILTERED)  # four neighbours of each kind
    scale = np.sqrt(variance * more / np.maximum(around, 1e-30))
    for draw in range(DRAWS):
        sign = np.where(np.random.default_rng(draw).random(mask.shape) < 0.5, -scale, scale)
        yield sign[..., None] * apart


def _shared_square(apart: Light, mask: Mask, lags: Sequence[tuple[int, int]]) -> tuple[float, float]:
    """Mean product of the differences of near pixels, and its standard deviation under independent noise."""
    total = squares = count = 0.0
    for here, there in map(_pair, lags):
        products = (apart[here] * apart[there]).mean(axis=-1)
        both = mask[here] & mask[there]
        total += float(products[both].sum())
        squares += float(np.square(products[both]).sum())
        count += np.count_nonzero(both)
    return total / max(count, 1.0), squares**0.5 / max(count, 1.0)


def _noise_variance(apart: Light, mask: Mask, lags: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """Variance (height, width) around each pixel without what its neighbours share, a mean over the channels."""
    products, pairs = np.zeros(mask.shape), np.zeros(mask.shape)
    for here, there in map(_pair, lags):
        both = mask[here] & mask[there]
        products[here] += (apart[here] * apart[there]).mean(axis=-1) * both
        pairs[here] += both
    shared = sums_around(products, NOISE_REACH) / np.maximum(sums_around(pairs, NOISE_REACH), 1.0)
    squares = sums_around(np.square(apart).mean(axis=-1) * mask, NOISE_REACH)
    variance = squares / np.maximum(sums_around(mask.astype(np.float64), NOISE_REACH), 1.0)
    return np.where(mask, np.maximum(variance - np.maximum(shared, 0.0), 0.0), 0.0)


def _pair(lag: tuple[int, int]) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Index of all pixels that have another so many rows and columns away, and of these."""
    rows, columns = lag
    forward, back = slice(columns, None), slice(None, -columns or None)
    if columns < 0:
        forward, back = slice(None, columns), slice(-columns, None)
    return (slice(None, -rows or None), back), (slice(rows, None), forward)


def _blurred(light: Light, mask: Mask) -> NDArray[np.float64]:
    """A Gaussian mean over the pixels of the mask, 0 elsewhere."""
    from scipy.ndimage import gaussian_filter

    inside = np.where(mask[..., None], light, 0.0).astype(np.float64)
    weight = gaussian_filter(mask.astype(np.float64), BLUR, mode="constant", truncate=3.0)[..., None]
    mean = gaussian_filter(inside, (BLUR, BLUR, 0.0), mode="constant", truncate=3.0)
    return np.where(mask[..., None], mean / np.maximum(weight, 1e-6), 0.0)


def displayed(light: Light) -> NDArray[np.float32]:
    """What a display shows of linear light, 1 being its white."""
    return srgb_from_linear(np.clip(light, 0.0, 1.0).astype(np.float32))


def mean_flip(first: NDArray[np.float32], second: NDArray[np.float32], mask: Mask) -> float:
    """Mean FLIP over a mask of two pictures in display values."""
    return float(flip_map(first, second)[mask].mean(dtype=np.float64))
