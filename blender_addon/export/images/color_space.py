# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours from Blender's working space, or from sRGB bytes, to linear Rec.709, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...versions import working_space_to_rec709


def to_rec709(color: ArrayLike) -> NDArray[np.float64]:
    """Return scene-linear RGB (..., 3) as linear Rec.709."""
    values = np.asarray(color, dtype=np.float64)
    matrix = working_space_to_rec709()
    return values if matrix is None else values @ matrix.T


def from_rec709(color: ArrayLike) -> NDArray[np.float64]:
    """Return linear Rec.709 (..., 3) as scene-linear RGB."""
    values = np.asarray(color, dtype=np.float64)
    matrix = working_space_to_rec709()
    return values if matrix is None else values @ np.linalg.inv(matrix).T


def srgb_to_linear(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Decode sRGB display values (IEC 61966-2-1)."""
    low = values / 12.92
    high = ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(values <= 0.04045, low, high).astype(np.float32)


def linear_to_srgb(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Encode as sRGB display values, also above 1; the inverse of `srgb_to_linear`."""
    high = 1.055 * np.maximum(values, 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.where(values <= 0.0031308, 12.92 * values, high).astype(np.float32)
