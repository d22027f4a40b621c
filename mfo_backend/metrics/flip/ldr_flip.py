# SPDX-License-Identifier: Apache-2.0
"""LDR-FLIP of two pictures.

References
----------
Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..display.colour import linear_from_srgb
from ..pixels.pixel_check import check_pair
from .flip_filters import DEFAULT_PIXELS_PER_DEGREE
from .flip_reference import FlipReference, comparisons

Array = NDArray[np.floating]


def planes_of(pixels: Array) -> Array:
    """Pixels (height, width, 3) as contiguous planes (3, height, width)."""
    return np.ascontiguousarray(np.moveaxis(pixels, -1, 0))


def pixels_of(planes: Array) -> Array:
    """Planes (3, height, width) as contiguous pixels (height, width, 3)."""
    return np.ascontiguousarray(np.moveaxis(planes, 0, -1))


def flip_map(reference: Array, test: Array, *, pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE) -> Array:
    """LDR-FLIP map (height, width) in [0, 1] of two pictures (height, width, 3) in sRGB display values.

    Values outside [0, 1] are clipped. The pooled FLIP value is the mean of the map. Computed in float64 and returned in
    float32: FLIP's powers turn the rounding of float32 into errors of 1e-4 where two pictures nearly agree.
    """
    check_pair(reference, test)
    shown = (np.clip(image.astype(np.float64), 0, 1) for image in (reference, test))
    light = [planes_of(linear_from_srgb(image)) for image in shown]
    comparison = next(comparisons([FlipReference(light[0], pixels_per_degree)], light[1]))
    return comparison.error.astype(np.float32)
