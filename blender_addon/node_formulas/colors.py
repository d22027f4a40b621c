# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours as hue, saturation and value, and the ways to blend two: `svm/color_util.h` and `util/color.h` of Cycles.

Colours are float32 (places, 3), numbers (places, 1); one of a single place is the same everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..export.images.color_space import to_rec709

Numbers = NDArray[np.float32]


def quotient(a: Numbers, b: Numbers, otherwise: Numbers | float = 0.0) -> Numbers:
    """a / b, and something else where b is 0."""
    return np.where(b != 0.0, a / np.where(b != 0.0, b, 1.0), otherwise)


def mixed(a: Numbers, b: Numbers, t: Numbers) -> Numbers:
    """From a to b by t."""
    return (1.0 - t) * a + t * b


def grey(color: Numbers) -> Numbers:
    """The luminance of colours of the working space, as numbers."""
    weights = to_rec709(np.eye(3)) @ (0.2126390, 0.7151687, 0.0721923)
    return color @ weights.astype(np.float32)[:, None]


def rgb_to_hsv(rgb: Numbers) -> Numbers:
    """Hue in [0, 1), saturation and value; hue is 0 of what has no saturation."""
    value, spread = rgb.max(axis=1, keepdims=True), np.ptp(rgb, axis=1, keepdims=True)
    red, green, blue = (quotient(value - rgb, spread)[:, k : k + 1] for k in range(3))
    of_green = np.where(rgb[:, 1:2] == value, 2.0 + red - blue, 4.0 + green - red)
    hue = np.where(rgb[:, :1] == value, blue - green, of_green) / 6.0
    return np.concatenate([np.where(spread != 0.0, hue % 1.0, 0.0), quotient(spread, value), value], axis=1)


def hsv_to_rgb(hsv: Numbers) -> Numbers:
    """The colour of a hue, a saturation and a value."""
    hue, saturation, value = (hsv[:, k : k + 1] for k in range(3))
    k = (np.array([5.0, 3.0, 1.0], np.float32) + 6.0 * hue) % 6.0
    return value * (1.0 - saturation * np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0))


def _overlay(t: Numbers, a: Numbers, b: Numbers) -> Numbers:
    dark, light = 1.0 - t + 2.0 * t * b, 1.0 - t + 2.0 * t * (1.0 - b)
    return np.where(a < 0.5, a * dark, 1.0 - light * (1.0 - a))


def _dodge(t: Numbers, a: Numbers, b: Numbers) -> Numbers:
    left = 1.0 - t * b
    lit = np.where(left > 0.0, np.minimum(quotient(a, left), 1.0), 1.0)
    return np.where(a != 0.0, lit, 0.0)


def _burn(t: Numbers, a: Numbers, b: Numbers) -> Numbers:
    left = 1.0 - t + t * b
    return np.where(left > 0.0, np.clip(1.0 - quotient(1.0 - a, left), 0.0, 1.0), 0.0)


def _of_hue(t: Numbers, a: Numbers, b: Numbers, taken: int) -> Numbers:
    """Blend towards a colour with the first `taken` of b's hue and saturation; a where b has no hue."""
    a, b = np.broadcast_arrays(a, b)
    own, other = rgb_to_hsv(a), rgb_to_hsv(b)
    there = np.concatenate([other[:, :taken], own[:, taken:]], axis=1)
    return np.where(other[:, 1:2] != 0.0, mixed(a, hsv_to_rgb(there), t), a)


def _of_part(t: Numbers, a: Numbers, b: Numbers, part: int) -> Numbers:
    """a with a saturation (1) or value (2) on the way to b's; a grey one keeps its saturation."""
    a, b = np.broadcast_arrays(a, b)
    own = rgb_to_hsv(a)
    there = own.copy()
    there[:, part : part + 1] = mixed(own[:, part : part + 1], rgb_to_hsv(b)[:, part : part + 1], t)
    return np.where((own[:, 1:2] != 0.0) | (part == 2), hsv_to_rgb(there), a)


BLENDS: Mapping[str, Callable[[Numbers, Numbers, Numbers], Numbers]] = {
    "MIX": lambda t, a, b: mixed(a, b, t),
    "ADD": lambda t, a, b: a + t * b,
    "MULTIPLY": lambda t, a, b: a * (1.0 - t + t * b),
    "SUBTRACT": lambda t, a, b: a - t * b,
    "SCREEN": lambda t, a, b: 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a),
    "DIVIDE": lambda t, a, b: (1.0 - t) * a + t * quotient(a, b, a),
    "DIFFERENCE": lambda t, a, b: mixed(a, np.abs(a - b), t),
    "EXCLUSION": lambda t, a, b: np.maximum(mixed(a, a + b - 2.0 * a * b, t), 0.0),
    "DARKEN": lambda t, a, b: mixed(a, np.minimum(a, b), t),
    "LIGHTEN": lambda t, a, b: mixed(a, np.maximum(a, b), t),
    "OVERLAY": _overlay,
    "DODGE": _dodge,
    "BURN": _burn,
    "SOFT_LIGHT": lambda t, a, b: mixed(a, a * ((1.0 - a) * b + 1.0 - (1.0 - b) * (1.0 - a)), t),
    "LINEAR_LIGHT": lambda t, a, b: a + t * (2.0 * b - 1.0),
    "HUE": lambda t, a, b: _of_hue(t, a, b, 1),
    "COLOR": lambda t, a, b: _of_hue(t, a, b, 2),
    "SATURATION": lambda t, a, b: _of_part(t, a, b, 1),
    "VALUE": lambda t, a, b: _of_part(t, a, b, 2),
}
