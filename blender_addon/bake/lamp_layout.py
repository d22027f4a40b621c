# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of what a lamp's nodes multiply its light with, and how they are laid out. Knows nothing of bpy.

The backend reads them (`mfo_backend/render/lamps/lamp_pattern.py`). A lamp shines along +Z of its own space. Directions
lie on discs of equal area: sin(angle / 2) grows evenly from the middle to the rim, so that a pixel holds the same solid
angle everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PATTERN_MARGIN = 1  # pixels around a disc, which filtering may look at
NEAR, FAR, STEPS = 1e-3, 1e3, 2048  # metres; between two steps a square is within 2e-5 of a line
INSIDE = 1e-3  # share of a cone's angle that measurements keep away from its rim


# what a lamp's values are looked up by
CONSTANT, DIRECTION, NORMAL, PLACE = "constant", "direction", "normal", "place"


@dataclass(frozen=True)
class Lookup:
    """By what the values of a lamp's nodes are looked up, whether they change with the distance (`falls`) and from
    bounce to bounce (`deep`), whether textures make them `fine`, and whether they are those of a place in the world."""

    by: str
    falls: bool
    deep: bool
    fine: bool
    placed: bool


def distances() -> NDArray[np.float64]:
    """The distances (STEPS,) of a falloff, in metres, evenly in their logarithms."""
    return np.geomspace(NEAR, FAR, STEPS)


def directions(side: int, rim: float, halves: int) -> NDArray[np.float64]:
    """Unit vectors (side * halves * side, 3) of the pixels' middles, row by row; first row at the largest y.

    Of two halves, side by side, the second is turned round by the Y axis. Beyond the rim of one alone directions are
    those at the rim.
    """
    axis = (np.arange(side) + 0.5 - side / 2) / (side / 2 - PATTERN_MARGIN)
    x, y = np.meshgrid(axis, -axis)
    sine = np.hypot(x, y) * math.sin(math.radians(rim) / 2)
    most = 1.0 if halves == 2 else math.sin(math.radians(rim) * (1.0 - INSIDE) / 2)
    half_angle = np.arcsin(np.minimum(sine, most))
    turn = np.arctan2(y, x)
    across = np.sin(2 * half_angle)
    front = np.stack([across * np.cos(turn), across * np.sin(turn), np.cos(2 * half_angle)], axis=-1)
    parts = [front, front * [-1.0, 1.0, -1.0]][:halves]
    return np.concatenate(parts, axis=1).reshape(-1, 3)


def places(side: int) -> NDArray[np.float64]:
    """Places (side * side, 3) of the pixels' middles on a square from -1 to 1, row by row, first row at the largest y;
    those at its edges are a little inside."""
    axis = (np.arange(side) + 0.5 - side / 2) / (side / 2 - PATTERN_MARGIN)
    x, y = np.meshgrid(*(np.clip(each, INSIDE - 1.0, 1.0 - INSIDE) for each in (axis, -axis)))
    return np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
