# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture scaled until it covers a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]


def covering(pixels: Pixels, size: tuple[int, int]) -> Pixels:
    """Scale a picture (height, width, channels) of linear colours until it covers `size` (width, height), and cut it.

    A pixel is the mean of what it covers; where the picture is smaller, neighbours are interpolated.
    """
    old = pixels.shape[1], pixels.shape[0]
    scale = max(size[0] / old[0], size[1] / old[1])
    for axis, count, length in ((1, size[0], old[0]), (0, size[1], old[1])):
        pixels = _resampled(pixels, axis, count, (length - count / scale) / 2.0, 1.0 / scale)
    return np.ascontiguousarray(pixels, dtype=np.float32)


def _resampled(pixels: Pixels, axis: int, count: int, first: float, step: float) -> Pixels:
    """`count` pixels along an axis, each `step` old ones long, from the place `first` on."""
    edges = first + step * np.arange(count + 1)
    moved = np.moveaxis(pixels.astype(np.float64), axis, 0)
    last = len(moved) - 1
    if step <= 1.0:
        place = np.clip((edges[:-1] + edges[1:]) / 2.0 - 0.5, 0.0, last)
        low = place.astype(int)
        weight = (place - low).reshape(-1, *[1] * (moved.ndim - 1))
        found = moved[low] * (1.0 - weight) + moved[np.minimum(low + 1, last)] * weight
    else:
        sums = np.concatenate([np.zeros_like(moved[:1]), np.cumsum(moved, axis=0)])
        edges = np.clip(edges, 0.0, len(moved))
        low = np.minimum(edges.astype(int), last)
        weight = (edges - low).reshape(-1, *[1] * (moved.ndim - 1))
        found = np.diff(sums[low] + weight * moved[low], axis=0) / step
    return np.moveaxis(found, 0, axis).astype(np.float32)
