# SPDX-License-Identifier: Apache-2.0
"""A display's picture of scene-linear radiance by a table: any view transform, look, curve, exposure and gamma."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from .colour import linear_from_srgb, linear_from_srgb_slope
from .invert_view import coordinates_of

Array = NDArray[np.floating]

HALF_LEVEL = 0.5 / 255  # display values are given in 8 bits as a rule; closer to the top they count as clipped


@dataclass(frozen=True, eq=False)
class BakedView:
    """Display values by trilinear interpolation in the logarithm of the radiance.

    Attributes
    ----------
    table
        sRGB display values, float32 (size, size, size, 3); the axes are blue, green, red. The first node of an axis is
        black, the others lie at 2^log2_min to 2^log2_max, evenly in the logarithm.
    log2_min, log2_max
        Linear Rec.709 radiance of the second and the last node, base-2 logarithms. The last holds for all above it.

    Raises
    ------
    BadInputError
        If the table has another shape, holds values outside of [0, 1], or the range is empty.
    """

    table: NDArray[np.float32]
    log2_min: float
    log2_max: float

    def __post_init__(self) -> None:
        size = len(self.table)
        if self.table.shape != (size, size, size, 3) or size < 3:
            raise BadInputError(f"The view's table has shape {self.table.shape}: it must be a cube of RGB values.")
        if not (np.isfinite(self.table).all() and self.table.min() >= 0 and self.table.max() <= 1):
            raise BadInputError("The view's table holds values outside of 0 to 1: export the job again.")
        if not (-64 <= self.log2_min < self.log2_max <= 64):
            raise BadInputError(f"The view's table spans {self.log2_min} to {self.log2_max} stops: export it again.")

    @cached_property
    def top(self) -> float:
        """Display values from here on are clipped."""
        return float(self.table.max()) - HALF_LEVEL

    @cached_property
    def white(self) -> NDArray[np.float64]:
        """Radiance (3,) from which on a grey's channels are clipped."""
        grey = np.einsum("iiic->ic", self.table)
        first = [np.searchsorted(np.maximum.accumulate(grey[:, c]), grey[:, c].max() - HALF_LEVEL) for c in range(3)]
        return self._radiance(np.array(first, np.float64))

    def display(self, linear: Array) -> Array:
        """sRGB display values in [0, 1] of scene-linear values (..., 3)."""
        return self.at(self._coordinate(linear))[0].astype(linear.dtype, copy=False)

    def display_jacobian(self, linear: Array) -> tuple[Array, Array]:
        """Display values (..., 3) and their derivatives (..., 3 displayed, 3 linear); 0 where a channel is clipped."""
        values, jacobian = self.at(self._coordinate(linear))
        jacobian = jacobian * self._coordinate_slope(linear)[..., None, :]
        return values.astype(linear.dtype, copy=False), jacobian.astype(linear.dtype, copy=False)

    def display_pullback(self, linear: Array, gradient: Array) -> Array:
        """Gradient with respect to `linear` from one with respect to `display(linear)`."""
        return np.einsum("...o,...oi->...i", gradient, self.display_jacobian(linear)[1])

    def display_push(self, linear: Array, tangent: Array) -> Array:
        """Change of `display(linear)` for the change `tangent` of `linear`, with any leading axes."""
        return np.einsum("...oi,...i->...o", self.display_jacobian(linear)[1], tangent)

    def light(self, linear: Array) -> Array:
        """Linear light in [0, 1] an sRGB display emits for scene-linear values."""
        return linear_from_srgb(self.display(linear))

    def light_pullback(self, linear: Array, gradient: Array) -> Array:
        """Gradient with respect to `linear` from one with respect to `light(linear)`."""
        return self.display_pullback(linear, gradient * linear_from_srgb_slope(self.display(linear)))

    def light_push(self, linear: Array, tangent: Array) -> Array:
        """Change of `light(linear)` for the change `tangent` of `linear`."""
        return self.display_push(linear, tangent) * linear_from_srgb_slope(self.display(linear))

    def linear(self, display: Array) -> Array:
        """Scene-linear values whose `display` comes closest; where a channel is clipped, one of the possible ones."""
        colours, inverse = np.unique(display.reshape(-1, 3), axis=0, return_inverse=True)
        found = self._radiance(coordinates_of(colours.astype(np.float64), self.table, self.at))
        return found[inverse.reshape(-1)].reshape(display.shape).astype(display.dtype, copy=False)

    def at(self, coordinate: Array) -> tuple[Array, Array]:
        """Values (..., 3) and derivatives (..., 3, 3) by the red, green and blue coordinate in nodes (..., 3)."""
        size = len(self.table)
        cell = np.minimum(coordinate.astype(np.int32), size - 2)
        red, green, blue = np.moveaxis((coordinate - cell)[..., None], -2, 0)
        first = (cell[..., 2] * size + cell[..., 1]) * size + cell[..., 0]
        nodes = self.table.reshape(-1, 3)
        rows, row_slopes = [], []
        for offset in (0, size, size**2, size**2 + size):
            low, high = nodes[first + offset], nodes[first + offset + 1]
            rows.append(low + red * (high - low))
            row_slopes.append(high - low)
        near, far = (rows[k] + green * (rows[k + 1] - rows[k]) for k in (0, 2))
        near_red, far_red = (row_slopes[k] + green * (row_slopes[k + 1] - row_slopes[k]) for k in (0, 2))
        by_green = (1 - blue) * (rows[1] - rows[0]) + blue * (rows[3] - rows[2])
        by_red = near_red + blue * (far_red - near_red)
        return near + blue * (far - near), np.stack([by_red, by_green, far - near], axis=-1)

    @property
    def _step(self) -> float:
        return (self.log2_max - self.log2_min) / (len(self.table) - 2)

    def _coordinate(self, linear: Array) -> Array:
        """In nodes: linear up to the second one, logarithmic from there to the last."""
        first, last = 2.0**self.log2_min, 2.0**self.log2_max
        inside = np.clip(linear, 0, last)
        logarithmic = 1 + (np.log2(np.maximum(inside, first)) - self.log2_min) / self._step
        return np.where(inside < first, inside / first, np.minimum(logarithmic, len(self.table) - 1))

    def _coordinate_slope(self, linear: Array) -> Array:
        first, last = 2.0**self.log2_min, 2.0**self.log2_max
        slope = 1 / np.where(linear < first, first, np.maximum(linear, first) * (np.log(2) * self._step))
        return slope * ((linear >= 0) & (linear <= last))

    def _radiance(self, coordinate: NDArray[np.float64]) -> NDArray[np.float64]:
        logarithmic = np.exp2(self.log2_min + (np.maximum(coordinate, 1) - 1) * self._step)
        return np.where(coordinate < 1, coordinate * 2.0**self.log2_min, logarithmic)
