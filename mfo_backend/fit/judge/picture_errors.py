# SPDX-License-Identifier: Apache-2.0
"""How far the pictures of a fit's start and result are from the reference."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import DisplayView, View
from ...metrics.flip.block_means import block_means, block_side, full_blocks, means_beside
from ...metrics.flip.exposure_range import lit_exposures
from ...metrics.flip.flip_error import flip_error
from ...metrics.flip.flip_filters import DEFAULT_PIXELS_PER_DEGREE, flip_reach
from ...metrics.flip.hdr_flip import HdrFlip
from ...metrics.losses.squared_loss import mean_squared_error
from ...types.image import Encoding, Image, Pixels
from .region import blocks_around


def picture_errors(
    reference: Image,
    start: Pixels,
    result: Pixels,
    mask: NDArray[np.bool_],
    counted: NDArray[np.bool_],
    display: View | None,
) -> dict[str, tuple[float, float]]:
    """Means over the `counted` pixels, [start, result]: ``flip``, ``mse`` and, for a linear reference, ``hdr_flip``.

    Where more than `MOST_COUNTED` pixels count, pictures are compared at a fraction of their size. `mask` chooses
    exposures, as it does for losses. Squared errors are those of radiance, or of a display's values.
    """
    linear = reference.encoding is Encoding.LINEAR
    view = display or (DisplayView.for_scene(reference.pixels, mask) if linear else DisplayView())
    side = block_side(counted)
    near = blocks_around(counted, side, side * flip_reach(DEFAULT_PIXELS_PER_DEGREE))
    chosen = full_blocks(counted[near], side)

    target = block_means(Image(reference.pixels[near], reference.encoding), side)
    linear_ones = (Image(pixels[near], Encoding.LINEAR) for pixels in (start, result))
    pictures = [means_beside(reference.encoding, picture, side, view) for picture in linear_ones]

    def means(maps: Iterator[NDArray]) -> tuple[float, float]:
        first, second = (float(of_picture[chosen].mean(dtype=np.float64)) for of_picture in maps)
        return first, second

    first, second = (mean_squared_error(target.pixels[chosen], picture.pixels[chosen]) for picture in pictures)
    errors = {
        "flip": means(flip_error(target, picture, display=view).map for picture in pictures),
        "mse": (first, second),
    }
    if linear:
        flip = HdrFlip(target.pixels, exposures=lit_exposures(reference.pixels, mask))
        errors["hdr_flip"] = means(flip.map(picture.pixels) for picture in pictures)
    return errors
