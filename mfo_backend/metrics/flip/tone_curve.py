# SPDX-License-Identifier: Apache-2.0
"""The tone curves HDR-FLIP looks through: y = (k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5), clipped to [0, 1].

References
----------
Andersson et al., "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics 2021, section 3; the
coefficients are those of FLIP.h 1.7 (ACES: fit of Narkowicz; Hable; Reinhard divides by 1 + Y).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from ..display.colour import LUMINANCE_WEIGHTS

Array = NDArray[np.floating]

_COEFFICIENTS = {
    "aces": (0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14),
    "hable": (0.231683, 0.013791, 0.0, 0.18, 0.3, 0.018),
    "reinhard": (0.0, 1.0, 0.0, 0.0, 1.0, 1.0),
}
_BRIGHT = 0.85  # what the exposure range puts the brightest and the median pixel at (Eurographics 2021, section 3.2)
_LARGEST = 1e6  # every curve has reached 1 (Reinhard to 1e-6); its square still is a float32


@dataclass(frozen=True)
class ToneCurve:
    """One of the curves by name: `aces` (the default of FLIP), `hable` or `reinhard`; images are linear planes."""

    name: str = "aces"

    def __post_init__(self) -> None:
        if self.name not in _COEFFICIENTS:
            raise BadInputError(f"Unknown tone curve {self.name!r}: choose one of {', '.join(_COEFFICIENTS)}.")

    @property
    def bright_input(self) -> float:
        """The input that maps to 0.85: the larger root of the quadratic."""
        k0, k1, k2, k3, k4, k5 = _COEFFICIENTS[self.name]
        a, b, c = k0 - _BRIGHT * k3, k1 - _BRIGHT * k4, k2 - _BRIGHT * k5
        if a == 0:
            return -c / b
        return float(max(np.roots([a, b, c]).real))

    def apply(self, planes: Array, exposure_ev: float) -> Array:
        """Displayed linear planes in [0, 1]; negative input counts as 0."""
        x = _exposed(planes, exposure_ev)
        if self.name == "reinhard":
            return np.minimum(x / (1 + _luminance(x)), 1)
        k0, k1, _, k3, k4, k5 = _COEFFICIENTS[self.name]
        numerator = x * (k0 * x + k1)
        numerator /= x * (k3 * x + k4) + k5
        return np.minimum(numerator, 1, out=numerator)

    def pullback(self, planes: Array, exposure_ev: float, gradient: Array) -> Array:
        """Gradient with respect to `planes` from one with respect to `apply(planes)`; 0 where either end clips."""
        x = _exposed(planes, exposure_ev)
        scale = 2.0**exposure_ev
        if self.name == "reinhard":
            denominator = 1 + _luminance(x)
            passed = gradient * (x <= denominator) / denominator
            weights = LUMINANCE_WEIGHTS.astype(x.dtype)[:, None, None]
            slope = passed - weights * (passed * x).sum(axis=0) / denominator
            return slope * scale * (planes >= 0)
        k0, k1, _, k3, k4, k5 = _COEFFICIENTS[self.name]
        numerator = x * (k0 * x + k1)
        denominator = x * (k3 * x + k4) + k5
        # the quotient rule, with the quotient in place of numerator / denominator
        quotient = numerator / denominator
        slope = 2 * k0 * x + k1
        slope -= quotient * (2 * k3 * x + k4)
        slope /= denominator
        slope *= gradient
        slope *= scale
        slope *= (quotient <= 1) & (planes >= 0)
        return slope


def _exposed(planes: Array, exposure_ev: float) -> Array:
    scale = 2.0**exposure_ev
    return np.clip(planes, 0, _LARGEST / scale) * planes.dtype.type(scale)


def _luminance(planes: Array) -> Array:
    return np.tensordot(LUMINANCE_WEIGHTS.astype(planes.dtype), planes, axes=1)
