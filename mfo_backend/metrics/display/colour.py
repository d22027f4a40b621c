# SPDX-License-Identifier: Apache-2.0
"""Colour transforms of the metrics: Rec.709/sRGB primaries and white throughout; planes have channels first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

# Linear Rec.709 -> CIE XYZ as exact rationals (NVlabs/flip, FLIP.h `LinearRGBToXYZ`)
RGB_TO_XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE_XYZ = RGB_TO_XYZ.sum(axis=1)
# XYZ relative to the white point, the input of both Lab and its linearised form
RGB_TO_RELATIVE_XYZ = RGB_TO_XYZ / WHITE_XYZ[:, None]
LUMINANCE_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])  # Rec. ITU-R BT.709, rounded as in FLIP.h

SRGB_TOE_LINEAR = 0.0031308
SRGB_TOE_DISPLAY = 0.04045

LAB_DELTA = 6.0 / 29.0  # CIE 15: below delta^3 the cube root continues as a line
_LAB_THRESHOLD = LAB_DELTA**3
_LAB_SLOPE = 1.0 / (3.0 * LAB_DELTA**2)
_LAB_OFFSET = 4.0 / 29.0


def luminance(pixels: Array) -> Array:
    """Relative luminance Y of linear Rec.709 pixels (..., 3)."""
    return pixels @ LUMINANCE_WEIGHTS.astype(pixels.dtype)


def srgb_from_linear(linear: Array) -> Array:
    """sRGB display values of linear values in [0, 1] (IEC 61966-2-1, the OETF)."""
    return np.where(
        linear <= SRGB_TOE_LINEAR,
        12.92 * linear,
        1.055 * np.maximum(linear, SRGB_TOE_LINEAR) ** (1 / 2.4) - 0.055,
    ).astype(linear.dtype, copy=False)


def srgb_from_linear_slope(linear: Array) -> Array:
    """Derivative of `srgb_from_linear`; 12.92 in the linear toe, so finite at black."""
    return np.where(
        linear <= SRGB_TOE_LINEAR,
        12.92,
        (1.055 / 2.4) * np.maximum(linear, SRGB_TOE_LINEAR) ** (1 / 2.4 - 1),
    ).astype(linear.dtype, copy=False)


def linear_from_srgb(display: Array) -> Array:
    """Linear values of sRGB display values in [0, 1]; the inverse of `srgb_from_linear`."""
    return np.where(
        display <= SRGB_TOE_DISPLAY,
        display / 12.92,
        ((np.maximum(display, SRGB_TOE_DISPLAY) + 0.055) / 1.055) ** 2.4,
    ).astype(display.dtype, copy=False)


def linear_from_srgb_slope(display: Array) -> Array:
    """Derivative of `linear_from_srgb`."""
    return np.where(
        display <= SRGB_TOE_DISPLAY,
        1 / 12.92,
        (2.4 / 1.055) * ((np.maximum(display, SRGB_TOE_DISPLAY) + 0.055) / 1.055) ** 1.4,
    ).astype(display.dtype, copy=False)


def lab_response(relative_xyz: Array) -> Array:
    """CIELAB's f(t): the cube root with its linear toe (CIE 15)."""
    return np.where(
        relative_xyz > _LAB_THRESHOLD, np.cbrt(relative_xyz), _LAB_SLOPE * relative_xyz + _LAB_OFFSET
    ).astype(relative_xyz.dtype, copy=False)


def lab_response_slope(response: Array) -> Array:
    """Derivative f'(t) given f(t) itself: 1/(3 f^2) on the cube root, constant on the toe."""
    # at f = delta both branches give 1/(3 delta^2), so the maximum joins them
    return (1.0 / 3.0) / np.square(np.maximum(response, LAB_DELTA))


def lab_from_relative_xyz(relative_xyz: Array) -> Array:
    """CIELAB planes (3, ...) of XYZ planes relative to white."""
    f = lab_response(relative_xyz)
    return np.stack([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])
