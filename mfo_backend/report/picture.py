# SPDX-License-Identifier: Apache-2.0
"""Pictures as a user sees them: Blender's view transform Standard, then 8-bit sRGB PNG."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from ..types.image import Encoding, Image, Pixels


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.floating]:
    """sRGB display values of linear values in [0, 1] (IEC 61966-2-1)."""
    root = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, root).astype(linear.dtype, copy=False)


def standard_view(pixels: Pixels, *, exposure_ev: float = 0.0, gamma: float = 1.0) -> Pixels:
    """Display values in [0, 1] of scene-linear pixels under Blender's view transform Standard.

    Blender applies the exposure in stops to the linear values and the power 1/gamma to the display values
    (Color Management panel, Blender 4.2 to 5.2).
    """
    exposed = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=1e30) * np.float32(2.0**exposure_ev), 0.0, 1.0)
    return (srgb_from_linear(exposed) ** np.float32(1.0 / gamma)).astype(np.float32)


def displayed(image: Image, *, exposure_ev: float = 0.0, gamma: float = 1.0) -> Pixels:
    """Display values of an image; one that already holds display values stays as given."""
    if image.encoding is Encoding.SRGB:
        return np.clip(image.pixels, 0.0, 1.0)
    return standard_view(image.pixels, exposure_ev=exposure_ev, gamma=gamma)


def png_bytes(display: Pixels) -> bytes:
    """An 8-bit PNG of display values (height, width, 3) in [0, 1]."""
    from PIL import Image as Pillow  # slow to import; only what writes pictures pays for it

    file = io.BytesIO()
    Pillow.fromarray(np.rint(np.clip(display, 0.0, 1.0) * 255).astype(np.uint8), "RGB").save(file, "PNG")
    return file.getvalue()
