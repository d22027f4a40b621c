# SPDX-License-Identifier: Apache-2.0
"""From scene-linear radiance to what a display shows: one exposure, a clip and the sRGB curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from .colour import (
    linear_from_srgb,
    linear_from_srgb_slope,
    luminance,
    srgb_from_linear,
    srgb_from_linear_slope,
)

Array = NDArray[np.floating]

# Share of the lit pixels that keep their values when a curve is chosen for a scene-linear reference; the rest clips
_UNCLIPPED_SHARE = 0.99
# A gamma other than 1 has infinite slope at black; below this display value the slope is the one here
_GAMMA_SLOPE_FLOOR = 1e-3


class View(Protocol):
    """What a display shows of scene-linear values (..., 3), with the derivatives in both directions."""

    def display(self, linear: Array) -> Array:
        """sRGB display values in [0, 1]."""
        ...

    def display_pullback(self, linear: Array, gradient: Array) -> Array:
        """Gradient with respect to `linear` from one with respect to `display(linear)`."""
        ...

    def display_push(self, linear: Array, tangent: Array) -> Array:
        """Change of `display(linear)` for the change `tangent` of `linear`, with any leading axes."""
        ...

    def light(self, linear: Array) -> Array:
        """Linear light in [0, 1] an sRGB display emits."""
        ...

    def light_pullback(self, linear: Array, gradient: Array) -> Array:
        """Gradient with respect to `linear` from one with respect to `light(linear)`."""
        ...

    def light_push(self, linear: Array, tangent: Array) -> Array:
        """Change of `light(linear)` for the change `tangent` of `linear`, with any leading axes."""
        ...


@dataclass(frozen=True)
class DisplayView:
    """Blender's view transform Standard: display = srgb(clip(2^exposure_ev x, 0, 1))^(1 / gamma).

    It is also the global gamma exposure curve of the LDR losses, with sRGB's curve as the gamma: its linear toe keeps
    the slope at black finite.

    Raises
    ------
    BadInputError
        If gamma is not positive or a value is not finite.
    """

    exposure_ev: float = 0.0
    gamma: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.exposure_ev) and abs(self.exposure_ev) <= 32):
            raise BadInputError(f"View exposure is {self.exposure_ev} stops: it must lie between -32 and 32.")
        if not (np.isfinite(self.gamma) and 0 < self.gamma <= 10):
            raise BadInputError(f"View gamma is {self.gamma}: it must lie above 0 and not above 10.")

    @staticmethod
    def for_scene(reference: Array, mask: NDArray[np.bool_] | None = None) -> DisplayView:
        """The view whose exposure lets 99 % of the lit (or masked) pixels of a linear reference stay below the clip."""
        values = luminance(np.maximum(reference, 0))
        values = values[values > 0] if mask is None else values[mask]
        white = float(np.quantile(values, _UNCLIPPED_SHARE)) if values.size else 0.0
        return DisplayView(float(np.clip(-np.log2(white), -32, 32)) if white > 0 else 0.0)

    def display(self, linear: Array) -> Array:
        """sRGB display values in [0, 1] of scene-linear values."""
        encoded = srgb_from_linear(self._exposed(linear))
        return encoded if self.gamma == 1 else encoded ** (1 / self.gamma)

    def display_slope(self, linear: Array) -> Array:
        """Derivative of `display`; 0 where it is clipped."""
        exposed = self._exposed(linear)
        slope = srgb_from_linear_slope(exposed)
        if self.gamma != 1:
            encoded = np.maximum(srgb_from_linear(exposed), _GAMMA_SLOPE_FLOOR)
            slope = slope * encoded ** (1 / self.gamma - 1) / self.gamma
        return slope * self._exposed_slope(linear)

    def light(self, linear: Array) -> Array:
        """Linear light in [0, 1] an sRGB display emits for scene-linear values."""
        if self.gamma == 1:
            return self._exposed(linear)
        return linear_from_srgb(self.display(linear))

    def light_slope(self, linear: Array) -> Array:
        """Derivative of `light`; 0 where it is clipped."""
        if self.gamma == 1:
            return self._exposed_slope(linear)
        return self.display_slope(linear) * linear_from_srgb_slope(self.display(linear))

    def display_pullback(self, linear: Array, gradient: Array) -> Array:
        """See `View`."""
        return gradient * self.display_slope(linear)

    def display_push(self, linear: Array, tangent: Array) -> Array:
        """See `View`."""
        return tangent * self.display_slope(linear)

    def light_pullback(self, linear: Array, gradient: Array) -> Array:
        """See `View`."""
        return gradient * self.light_slope(linear)

    def light_push(self, linear: Array, tangent: Array) -> Array:
        """See `View`."""
        return tangent * self.light_slope(linear)

    def linear(self, display: Array) -> Array:
        """Scene-linear values of sRGB display values; those above a display's white are lost."""
        shown = np.clip(display, 0, 1) ** display.dtype.type(self.gamma)
        return linear_from_srgb(shown) * display.dtype.type(2.0**-self.exposure_ev)

    def _exposed(self, linear: Array) -> Array:
        # dividing the limit, not multiplying the values, cannot overflow
        scale = 2.0**self.exposure_ev
        return np.clip(linear, 0, 1 / scale) * linear.dtype.type(scale)

    def _exposed_slope(self, linear: Array) -> Array:
        scale = 2.0**self.exposure_ev
        return ((linear >= 0) & (linear <= 1 / scale)) * linear.dtype.type(scale)
