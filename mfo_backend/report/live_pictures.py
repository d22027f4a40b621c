# SPDX-License-Identifier: Apache-2.0
"""Pictures to look at while a fit runs: the values so far and their FLIP map, small enough to cost next to nothing."""

from __future__ import annotations

import numpy as np

from ..metrics.display.tone_mapping import View
from ..metrics.flip.block_means import block_means, full_blocks
from ..metrics.flip.flip_error import flip_error
from ..types.event import PREVIEW_SIDE
from ..types.image import Encoding, Image, Pixels
from .difference_map import magma_counted
from .picture import block_side_within, displayed, thumbnail_bytes

LARGEST_MAP = 128  # FLIP of this many takes a fifth of that of a 256x256 picture


class LivePictures:
    """Thumbnails of scene-linear pictures of the size of `reference`, averaged over blocks of pixels."""

    def __init__(self, reference: Image, view: View) -> None:
        self._view = view
        self._reference = reference
        self._compared = _small(reference, LARGEST_MAP)
        side = block_side_within(reference.pixels.shape, LARGEST_MAP)
        self._counts = None if reference.counts is None else full_blocks(reference.counts, side)

    def reference(self) -> bytes:
        """The reference under the view, as large as `current`."""
        return thumbnail_bytes(displayed(_small(self._reference, PREVIEW_SIDE), self._view))

    def current(self, pixels: Pixels) -> bytes:
        """The picture under the view, PREVIEW_SIDE wide or high at most."""
        return thumbnail_bytes(displayed(_small(Image(pixels, Encoding.LINEAR), PREVIEW_SIDE), self._view))

    def difference(self, pixels: Pixels) -> bytes:
        """The FLIP map of pictures averaged to LARGEST_MAP; for the eye, its mean is not the FLIP of the picture."""
        test = _small(Image(np.nan_to_num(pixels), Encoding.LINEAR), LARGEST_MAP)
        return thumbnail_bytes(magma_counted(flip_error(self._compared, test, display=self._view).map, self._counts))


def _small(image: Image, largest: int) -> Image:
    """Means over square blocks, so that no side is above `largest`; what does not fill a block is left out."""
    return block_means(image, block_side_within(image.pixels.shape, largest))
