# SPDX-License-Identifier: Apache-2.0
"""Views as tables of known functions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mfo_backend.metrics.display.baked_view import BakedView

# rows sum to 1, as those of a view that keeps greys grey
MIXING = np.array([[0.8, 0.15, 0.05], [0.1, 0.8, 0.1], [0.05, 0.15, 0.8]])


def filmic(linear: np.ndarray) -> np.ndarray:
    """A smooth curve of mixed channels with a shoulder, as AgX has."""
    mixed = np.maximum(linear, 0) @ MIXING.T
    return (mixed / (0.5 + mixed)) ** 0.5


def baked(function: Callable[[np.ndarray], np.ndarray], size: int = 48) -> BakedView:
    """A table as the add-on bakes it."""
    axis = np.r_[0, np.exp2(np.linspace(-12.75, 4.5, size - 1))]
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return BakedView(function(np.stack([red, green, blue], -1)).astype(np.float32), -12.75, 4.5)
