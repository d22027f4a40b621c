# SPDX-License-Identifier: Apache-2.0
"""Single pixels that are far brighter than all around them: rare paths, not the material."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...metrics.colour import luminance
from ...types.image import Pixels

FACTOR = 10.0  # times the brightest of the eight neighbours; a highlight that a pixel resolves falls off slower
_AROUND = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if (dy, dx) != (0, 0)]


def without_fireflies(image: Pixels, mask: NDArray[np.bool_]) -> tuple[Pixels, int]:
    """The linear image (height, width, 3) with fireflies inside `mask` set to the mean around them, and their number.

    Only for finding a start: the mean of the picture loses what they carry.
    """
    height, width = mask.shape
    level = luminance(image)
    padded = np.pad(level, 1, mode="edge")
    near = np.zeros_like(level)
    for dy, dx in _AROUND:
        np.maximum(near, padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width], out=near)
    floor = 0.1 * float(level[mask].mean()) if mask.any() else 0.0
    row, column = np.nonzero(mask & (level > FACTOR * np.maximum(near, floor)))
    around = [image[np.clip(row + dy, 0, height - 1), np.clip(column + dx, 0, width - 1)] for dy, dx in _AROUND]
    calm = image.astype(np.float32)
    calm[row, column] = np.mean(around, axis=0)
    return calm, len(row)
