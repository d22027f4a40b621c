# SPDX-License-Identifier: Apache-2.0
"""Pictures to look at while a fit runs: the values so far and their FLIP map, small enough to cost next to nothing."""

from __future__ import annotations

import numpy as np

from ..metrics.flip_error import flip_error
from ..metrics.tone_mapping import View
from ..types.image import Encoding, Image, Pixels
from .difference_map import magma
from .picture import displayed_linear, png_bytes

LARGEST_SIDE = 256  # pixels; a panel shows no more
LARGEST_MAP = 128  # FLIP of this many takes a fifth of that of a 256x256 picture


class LivePictures:
    """PNGs of scene-linear pictures of the size of `reference`, averaged over blocks of pixels."""

    def __init__(self, reference: Image, view: View) -> None:
        self._view = view
        self._reference = Image(_small(reference.pixels, LARGEST_MAP), reference.encoding)

    def current(self, pixels: Pixels) -> bytes:
        """The picture under the view, LARGEST_SIDE wide or high at most."""
        return png_bytes(displayed_linear(_small(pixels, LARGEST_SIDE), self._view))

    def difference(self, pixels: Pixels) -> bytes:
        """The FLIP map of pictures averaged to LARGEST_MAP; for the eye, its mean is not the FLIP of the picture."""
        test = Image(np.nan_to_num(_small(pixels, LARGEST_MAP)), Encoding.LINEAR)
        return png_bytes(magma(flip_error(self._reference, test, display=self._view).map))


def _small(pixels: Pixels, largest: int) -> Pixels:
    """Means over square blocks, so that no side is above `largest`; what does not fill a block is left out."""
    block = -(-max(pixels.shape[:2]) // largest)
    height, width = pixels.shape[0] // block, pixels.shape[1] // block
    if block == 1 or not height or not width:  # a strip thinner than a block stays as it is
        return pixels
    cut = pixels[: height * block, : width * block]
    return cut.reshape(height, block, width, block, 3).mean(axis=(1, 3)).astype(np.float32)
