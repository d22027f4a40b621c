# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures of a job, and two of them as one: a preview of Blender is a square. No bpy here."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Thumbnail = NDArray[np.uint8]  # display values (height, width, 3), first row at the top

_GAP = 0.015  # between two pictures, of their longer side
_HEADER = re.compile(rb"P6\s+(\d+)\s+(\d+)\s+255\s")
_WIDE = math.sqrt(2.0)  # width over height from which two, one above the other, fill a square better than one does


def read_thumbnail(path: Path) -> Thumbnail:
    """A binary PPM with 8 bits a channel (netpbm's ppm(5)).

    Raises
    ------
    OSError
        If it cannot be read or is something else.
    """
    data = path.read_bytes()
    header = _HEADER.match(data)
    width, height = map(int, header.groups()) if header else (0, 0)
    if header is None or not width * height or len(data) != header.end() + 3 * width * height:
        raise OSError(f"{path} is not a picture")
    return np.frombuffer(data, np.uint8, offset=header.end()).reshape(height, width, 3)


def paired(first: Thumbnail, second: Thumbnail) -> NDArray[np.uint8] | None:
    """Both in one picture (height, width, 4), with alpha: wide ones one above the other, tall ones side by side.

    None where each fills a square better alone, or their sizes differ.
    """
    height, width = first.shape[:2]
    if first.shape != second.shape or max(width, height) < _WIDE * min(width, height):
        return None
    axis = 0 if is_wide(first) else 1
    between = list(first.shape)
    between[axis] = max(1, round(_GAP * max(width, height)))
    gap = np.zeros((*between[:2], 4), np.uint8)
    return np.concatenate([opaque(first), gap, opaque(second)], axis=axis)


def is_wide(picture: Thumbnail) -> bool:
    """Whether it is wider than high, so that another one belongs below it."""
    return picture.shape[1] > picture.shape[0]


def opaque(picture: Thumbnail) -> NDArray[np.uint8]:
    """The picture with an alpha of 1."""
    return np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)])
