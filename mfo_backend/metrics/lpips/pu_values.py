# SPDX-License-Identifier: Apache-2.0
"""The picture LPIPS(PU) compares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..responses.pu21 import pu21, pu21_slope
from ..responses.response import ChannelResponse

Array = NDArray[np.floating]

_PEAK = 300.0  # cd/m^2
_WHITE = 255.0  # PU21 value that stands for 1: that of 99 cd/m^2


@dataclass(frozen=True)
class PuValues(ChannelResponse):
    """PU21 of each channel over 255, with `nits` cd/m^2 for a radiance of 1 and a clip at 300 cd/m^2 (1.30).

    Source: the PU21 authors' own LPIPS(PU), class `pu_lpips` of gfxdisp/ColorVideoVDP, branch comparison-metrics.
    """

    nits: float

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return (pu21(self._clipped(linear)) / _WHITE).astype(linear.dtype, copy=False)

    def slope(self, linear: Array) -> Array:
        """See `ChannelResponse`."""
        seen = (linear >= 0) & (linear <= _PEAK / self.nits)
        return (seen * pu21_slope(self._clipped(linear)) * (self.nits / _WHITE)).astype(linear.dtype, copy=False)

    def _clipped(self, linear: Array) -> Array:
        return np.clip(linear, 0, _PEAK / self.nits) * linear.dtype.type(self.nits)
