# SPDX-License-Identifier: Apache-2.0
"""Pictures as a user sees them: display values under the scene's view, as files with 8 bits a channel."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from ..metrics.display.tone_mapping import View
from ..metrics.flip.block_means import block_means
from ..types.image import Encoding, Image, Pixels

THUMBNAIL_SIDE = 512  # pixels at most: a panel of the usual width on a screen of twice the usual density


def displayed(image: Image, view: View) -> Pixels:
    """Display values in [0, 1] of an image; one that already holds display values stays as given."""
    if image.encoding is Encoding.SRGB:
        return np.clip(image.pixels, 0.0, 1.0)
    return displayed_linear(image.pixels, view)


def displayed_linear(pixels: Pixels, view: View) -> Pixels:
    """Display values in [0, 1] of scene-linear pixels; NaN is black."""
    return view.display(np.nan_to_num(pixels, nan=0.0)).astype(np.float32)


def png_bytes(display: Pixels) -> bytes:
    """An 8-bit PNG of display values (height, width, 3) in [0, 1]."""
    return _png(_levels(display))


def thumbnail_bytes(display: Pixels, largest: int = THUMBNAIL_SIDE) -> bytes:
    """A binary PPM of display values (height, width, 3) in [0, 1]: means over blocks, no side above `largest` pixels.

    Its pixels stand there as they are: who shows it needs no library.
    """
    small = _levels(block_means(Image(display, Encoding.SRGB), block_side_within(display.shape, largest)).pixels)
    height, width = small.shape[:2]
    return b"P6 %d %d 255\n" % (width, height) + small.tobytes()


def block_side_within(shape: tuple[int, ...], largest: int) -> int:
    """Pixels along each side of the blocks; a strip thinner than that stays as it is."""
    side = -(-max(shape[:2]) // largest)
    return 1 if side > min(shape[:2]) else side


def mask_png(mask: NDArray[np.bool_]) -> bytes:
    """A PNG that is white where `mask` (height, width) is True and black elsewhere."""
    return _png(np.where(mask, np.uint8(255), np.uint8(0)))


def mask_from_png(data: bytes) -> NDArray[np.bool_]:
    """What `mask_png` was given."""
    from PIL import Image as Pillow

    with Pillow.open(io.BytesIO(data)) as picture:
        return np.asarray(picture.convert("L")) > 127


def _levels(display: Pixels) -> NDArray[np.uint8]:
    return np.rint(np.clip(display, 0.0, 1.0) * 255).astype(np.uint8)


def _png(values: NDArray[np.uint8]) -> bytes:
    from PIL import Image as Pillow  # slow to import; only what writes pictures pays for it

    file = io.BytesIO()
    # a third of the time of Pillow's 6, and a tenth more space
    Pillow.fromarray(values).save(file, "PNG", compress_level=2)
    return file.getvalue()
