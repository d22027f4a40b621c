# SPDX-License-Identifier: Apache-2.0
"""Scene-linear radiance as light of a display."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..responses.response import ChannelResponse

Array = NDArray[np.floating]


@dataclass(frozen=True)
class DisplayLight(ChannelResponse):
    """cd/m^2, with `nits` for a radiance of 1, clipped to what the display can show: [0, `peak_nits`]."""

    nits: float
    peak_nits: float

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        # dividing the limit, not multiplying the values, cannot overflow
        clipped = np.clip(linear, 0, self.peak_nits / self.nits)
        return (clipped * self.nits).astype(linear.dtype, copy=False)

    def slope(self, linear: Array) -> Array:
        """See `ChannelResponse`."""
        seen = (linear >= 0) & (linear <= self.peak_nits / self.nits)
        return np.where(seen, self.nits, 0).astype(linear.dtype)
