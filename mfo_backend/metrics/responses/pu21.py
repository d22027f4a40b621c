# SPDX-License-Identifier: Apache-2.0
"""PU21: luminance made perceptually uniform; 100 cd/m^2 becomes about 256.

References
----------
Mantiuk and Azimi, "PU21: A novel perceptually uniform encoding for adapting existing quality metrics for HDR", PCS
2021; parameters of the variant `banding_glare` from gfxdisp/pu21.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .response import ChannelResponse

Array = NDArray[np.floating]

_P = (0.353487901, 0.3734658629, 8.277049286e-05, 0.9062562627, 0.09150303166, 0.9099517204, 596.3148142)
_DARKEST, _BRIGHTEST = 0.005, 10000.0  # cd/m^2; the encoding is defined between them


def pu21(nits: Array) -> Array:
    """PU21 values of luminance (or absolute linear RGB) in cd/m^2, clipped to [0.005, 10000]."""
    p1, p2, p3, p4, p5, p6, p7 = _P
    power = np.clip(nits, _DARKEST, _BRIGHTEST) ** p4
    return np.maximum(p7 * (((p1 + p2 * power) / (1 + p3 * power)) ** p5 - p6), 0)


def pu21_slope(nits: Array) -> Array:
    """Derivative of `pu21`; 0 where it is clipped."""
    p1, p2, p3, p4, p5, _, p7 = _P
    clipped = np.clip(nits, _DARKEST, _BRIGHTEST)
    power = clipped**p4
    numerator, denominator = p1 + p2 * power, 1 + p3 * power
    ratio_slope = (p2 - p1 * p3) / np.square(denominator) * p4 * power / clipped
    slope = p7 * p5 * (numerator / denominator) ** (p5 - 1) * ratio_slope
    return slope * ((nits >= _DARKEST) & (nits <= _BRIGHTEST))


@dataclass(frozen=True)
class Pu21(ChannelResponse):
    """PU21 of each channel, with `nits` cd/m^2 for a radiance of 1."""

    nits: float

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return pu21(linear * linear.dtype.type(self.nits)).astype(linear.dtype, copy=False)

    def slope(self, linear: Array) -> Array:
        """See `ChannelResponse`."""
        scale = linear.dtype.type(self.nits)
        return (pu21_slope(linear * scale) * scale).astype(linear.dtype, copy=False)
