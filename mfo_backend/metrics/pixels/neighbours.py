# SPDX-License-Identifier: Apache-2.0
"""Pixels or tiles of a picture and those around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def next_to(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Index of all pixels but the last along an axis (0 or 1), and of their neighbours."""
    here, there = [slice(None)] * 2, [slice(None)] * 2
    here[axis], there[axis] = slice(0, -1), slice(1, None)
    return tuple(here), tuple(there)


def neighbour_pairs(pixels: NDArray[np.int64], shape: tuple[int, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Positions (n,) in `pixels`, flat indices in a picture of this shape, and those of neighbours of theirs."""
    place = np.full(shape, -1)
    place.ravel()[pixels] = np.arange(len(pixels))
    first, second = (
        np.concatenate([place[side].ravel() for side in sides])
        for sides in zip(*(next_to(axis) for axis in (0, 1)), strict=True)
    )
    both = (first >= 0) & (second >= 0)
    return first[both], second[both]


def sums_around(picture: NDArray, reach: int) -> NDArray[np.float64]:
    """Sums (height, width, ...) over each entry and its neighbours, `reach` to each side along both axes."""
    total = picture
    for axis in (0, 1):
        padded = np.pad(total, [(reach, reach) if k == axis else (0, 0) for k in range(total.ndim)])
        size = picture.shape[axis]
        total = sum(np.take(padded, range(k, k + size), axis) for k in range(2 * reach + 1))
    return np.asarray(total)
