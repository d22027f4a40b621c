# SPDX-License-Identifier: Apache-2.0
"""The error of a pixel from two images' features, and its gradient.

The error of a pixel is E = Ec^(1 - Ef), with the colour error Ec a power of the HyAB distance between the two
images as the eye resolves them, and the feature error Ef the larger of their differences in edges and points.

References
----------
Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020, section 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..display.colour import RGB_TO_RELATIVE_XYZ, lab_from_relative_xyz
from .flip_features import FlipFeatures, Perceived, norm

Array = NDArray[np.floating]

_QC, _QF, _PC, _PT = 0.7, 0.5, 0.4, 0.95  # HPG 2020, section 4.1.3 and equation 13

# E has infinite slope where two images agree. The value is exact everywhere; the slope is that of these floors once
# the differences fall below them, where float32 images hold nothing but rounding (Lab values up to 100, features to 1).
_HYAB_SLOPE_FLOOR = 1e-5
_FEATURE_SLOPE_FLOOR = 1e-7


def _largest_colour_error() -> float:
    """HyAB distance of Hunt-adjusted green and blue to the power qc (HPG 2020, section 4.1.3)."""
    lab = lab_from_relative_xyz(RGB_TO_RELATIVE_XYZ @ np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    lab[1:] *= 0.01 * lab[0]
    difference = lab[:, 0] - lab[:, 1]
    return float((abs(difference[0]) + np.hypot(difference[1], difference[2])) ** _QC)


_C_MAX = _largest_colour_error()
_C_KNEE = _PC * _C_MAX
_LOWER_SLOPE = _PT / _C_KNEE
_UPPER_SLOPE = (1 - _PT) / (_C_MAX - _C_KNEE)


class FlipDifference:
    """The FLIP map between two images of one size.

    `error` is the map (height, width) in [0, 1], exactly 0 where both are equal.
    """

    def __init__(self, reference: Perceived, test: FlipFeatures) -> None:
        self._test = test
        self._lab = test.perceived.lab - reference.lab
        self._edge = test.perceived.edge - reference.edge
        self._point = test.perceived.point - reference.point
        self._chroma = norm(self._lab[1], self._lab[2])
        self._hyab = np.abs(self._lab[0])
        self._hyab += self._chroma
        self._colour_error = _redistribute(self._hyab)
        feature = np.maximum(np.abs(self._edge), np.abs(self._point))
        feature *= np.sqrt(0.5)
        self._feature = feature
        # the detectors' norms reach sqrt(2) only up to rounding; above 1 the power of a zero colour error would be inf
        self._exponent = 1 - np.minimum(np.sqrt(feature), 1)
        self.error = np.power(self._colour_error, self._exponent)

    def pullback(self, weight: Array) -> Array:
        """Gradient of sum(weight * error) with respect to the test image's linear planes, (3, height, width).

        Where a pixel's difference is zero, the error's minimum and cusp, its contribution is 0.
        """
        hyab = np.maximum(self._hyab, _HYAB_SLOPE_FLOOR)
        colour_error = np.maximum(self._colour_error, float(_redistribute(_HYAB_SLOPE_FLOOR)))
        error = weight * self.error
        slope = np.where(self._colour_error < _PT, _QC * _LOWER_SLOPE, _QC * _UPPER_SLOPE).astype(hyab.dtype)
        g_hyab = slope * np.power(hyab, _QC - 1)
        g_hyab *= self._exponent * error / colour_error
        g_lab = np.empty_like(self._lab)
        np.multiply(g_hyab, np.sign(self._lab[0]), out=g_lab[0])
        g_lab[1:] = self._lab[1:] * np.divide(g_hyab, self._chroma, out=np.zeros_like(g_hyab), where=self._chroma > 0)

        # dE/dEf = -ln(Ec) E, dEf/dx = qf x^(qf - 1)
        g_feature = np.log(colour_error)
        g_feature *= error
        g_feature *= -_QF * np.sqrt(0.5)
        g_feature /= np.sqrt(np.maximum(self._feature, _FEATURE_SLOPE_FLOOR))
        edge_wins = np.abs(self._edge) >= np.abs(self._point)
        g_edge = np.where(edge_wins, g_feature * np.sign(self._edge), 0)
        g_point = np.where(edge_wins, 0, g_feature * np.sign(self._point))
        return self._test.pullback(g_lab, g_edge, g_point)


def _redistribute(hyab):  # type: ignore[no-untyped-def]  # array or float alike
    """Colour error in [0, 1] of a HyAB distance: the lower 40 % of the range fill 95 % of it (HPG 2020, eq. 8)."""
    power = np.power(hyab, _QC)
    return np.where(power < _C_KNEE, power * _LOWER_SLOPE, _PT + (power - _C_KNEE) * _UPPER_SLOPE).astype(power.dtype)
