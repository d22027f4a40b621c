# SPDX-License-Identifier: Apache-2.0
"""What FLIP compares of one image: its colours as the eye resolves them, its edges and its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..display.colour import RGB_TO_RELATIVE_XYZ, lab_response, lab_response_slope
from .flip_filters import FlipFilters

Array = NDArray[np.floating]

# YCxCz without its factors 116, 500, 200 and its offset: filters that sum to one commute with both
_OPPONENT_FROM_RELATIVE_XYZ = np.array([[0.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
_RGB_TO_OPPONENT = _OPPONENT_FROM_RELATIVE_XYZ @ RGB_TO_RELATIVE_XYZ
_OPPONENT_TO_RGB = np.linalg.inv(_RGB_TO_OPPONENT)
_HUNT = 0.01  # a* and b* are scaled by 0.01 L*: colours of dark pixels count less (HPG 2020, section 4.1)


def mix(matrix: Array, planes: Array) -> Array:
    """`matrix` (3, 3) applied to the channels of `planes` (3, height, width)."""
    return (matrix.astype(planes.dtype, copy=False) @ planes.reshape(3, -1)).reshape(planes.shape)


@dataclass(frozen=True)
class Perceived:
    """What FLIP compares of one image.

    `lab` is Hunt-adjusted CIELAB after the eye's low-pass, (3, height, width); `edge` and `point` are the norms of
    the detectors' answers on unfiltered luminance, (height, width).
    """

    lab: Array
    edge: Array
    point: Array


def norm(x: Array, y: Array) -> Array:
    """sqrt(x^2 + y^2); unlike `np.hypot` it is vectorised, and nothing here comes near under- or overflow."""
    squares = x * x
    squares += y * y
    return np.sqrt(squares, out=squares)


class FlipFeatures:
    """`perceived` of linear RGB planes in [0, 1], with what the adjoint needs."""

    def __init__(self, planes: Array, filters: FlipFilters) -> None:
        self._filters = filters
        opponent = mix(_RGB_TO_OPPONENT, planes)
        self._detail = filters.features(opponent[0])
        edge, point = norm(*self._detail[:2]), norm(*self._detail[2:])

        seen = mix(_OPPONENT_TO_RGB, filters.low_pass(opponent))
        self._unclipped = (seen >= 0) & (seen <= 1)
        np.clip(seen, 0, 1, out=seen)
        self._response = lab_response(mix(RGB_TO_RELATIVE_XYZ, seen))
        f0, f1, f2 = self._response
        lab = np.empty_like(planes)
        np.multiply(f1, 116, out=lab[0])
        lab[0] -= 16
        hunt = lab[0] * _HUNT
        np.multiply(hunt, 500 * (f0 - f1), out=lab[1])
        np.multiply(hunt, 200 * (f1 - f2), out=lab[2])
        self.perceived = Perceived(lab, edge, point)

    def pullback(self, lab: Array, edge: Array, point: Array) -> Array:
        """Gradient with respect to the planes of a function with these gradients in `lab`, `edge` and `point`."""
        f0, f1, f2 = self._response
        hunt = _HUNT * self.perceived.lab[0]
        g_a, g_b = 500 * hunt * lab[1], 200 * hunt * lab[2]
        g_lightness = lab[0] + 5 * (f0 - f1) * lab[1] + 2 * (f1 - f2) * lab[2]  # 0.01 * 500 and 0.01 * 200
        g_response = np.empty_like(self._response)
        g_response[0] = g_a
        g_response[1] = 116 * g_lightness - g_a + g_b
        g_response[2] = -g_b
        g_response *= lab_response_slope(self._response)
        g_seen = mix(RGB_TO_RELATIVE_XYZ.T, g_response)
        g_seen *= self._unclipped
        g_opponent = self._filters.low_pass_adjoint(mix(_OPPONENT_TO_RGB.T, g_seen))

        g_detail = np.empty_like(self._detail)
        g_detail[:2] = self._detail[:2] * _divide(edge, self.perceived.edge)
        g_detail[2:] = self._detail[2:] * _divide(point, self.perceived.point)
        g_opponent[0] += self._filters.features_adjoint(g_detail)
        return mix(_RGB_TO_OPPONENT.T, g_opponent)


def _divide(numerator: Array, norm: Array) -> Array:
    """numerator / norm, and 0 where the norm is 0: the norm's minimum, where 0 is a subgradient."""
    return np.divide(numerator, norm, out=np.zeros_like(norm), where=norm > 0)
