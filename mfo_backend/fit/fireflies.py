# SPDX-License-Identifier: Apache-2.0
"""Single pixels that are far brighter than all around them: rare paths, not the material."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..metrics.colour import luminance
from ..types.image import Pixels

FACTOR = 10.0  # times the brightest of the eight neighbours; a highlight that a pixel resolves falls off slower


def without_fireflies(image: Pixels, mask: NDArray[np.bool_]) -> tuple[Pixels, int]:
    """The linear image (height, width, 3) with fireflies inside `mask` set to the mean around them, and their number.

    Only for finding a start: the mean of the picture loses what they carry.
    """
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = mask.shape
    shifts = [(dy, dx) for dy in range(3) for dx in range(3) if (dy, dx) != (1, 1)]
    around = np.stack([padded[dy : dy + height, dx : dx + width] for dy, dx in shifts])
    level = luminance(image)
    near = luminance(around).max(0)
    floor = 0.1 * float(level[mask].mean()) if mask.any() else 0.0
    found = mask & (level > FACTOR * np.maximum(near, floor))
    return np.where(found[..., None], around.mean(0), image).astype(np.float32), int(found.sum())
