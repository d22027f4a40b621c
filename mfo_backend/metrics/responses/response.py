# SPDX-License-Identifier: Apache-2.0
"""Pointwise responses to radiance: what a squared loss compares instead of the radiance itself.

A response knows its derivative in both directions: `pullback` for gradients with respect to an image, `push` for the
columns of a least-squares Jacobian.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..display.colour import luminance
from ..display.tone_mapping import DisplayView, View

Array = NDArray[np.floating]


class Response(Protocol):
    """Three numbers for every linear RGB pixel (..., 3), each pixel on its own."""

    def apply(self, linear: Array) -> Array:
        """The response to linear pixels, of the same shape."""
        ...

    def pullback(self, linear: Array, gradient: Array) -> Array:
        """Gradient with respect to `linear` from one with respect to the response."""
        ...

    def push(self, linear: Array, tangent: Array) -> Array:
        """Change of the response for the change `tangent` (..., height, width, 3) of `linear`."""
        ...


class ChannelResponse(ABC):
    """A response of each channel to itself alone, given by its slope."""

    @abstractmethod
    def slope(self, linear: Array) -> Array:
        """Derivative of the response, of the shape of `linear`."""

    def pullback(self, linear: Array, gradient: Array) -> Array:
        """See `Response`."""
        return gradient * self.slope(linear)

    def push(self, linear: Array, tangent: Array) -> Array:
        """See `Response`."""
        return tangent * self.slope(linear)


@dataclass(frozen=True)
class Scaled(ChannelResponse):
    """Radiance times `scale`: a number, or an array (height, width, 3)."""

    scale: float | Array = 1.0

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return (linear * self.scale).astype(linear.dtype, copy=False)

    def slope(self, linear: Array) -> Array:
        """See `ChannelResponse`."""
        return np.broadcast_to(np.asarray(self.scale, linear.dtype), linear.shape)


@dataclass(frozen=True)
class Logarithmic(ChannelResponse):
    """log(1 + x / `toe`), linear below and logarithmic above `toe`; negative radiance counts as 0."""

    toe: float

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return np.log1p(np.maximum(linear, 0) / linear.dtype.type(self.toe))

    def slope(self, linear: Array) -> Array:
        """See `ChannelResponse`."""
        return (linear >= 0) / (np.maximum(linear, 0) + linear.dtype.type(self.toe))


@dataclass(frozen=True)
class Displayed(ChannelResponse):
    """sRGB display values through a view."""

    view: DisplayView

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return self.view.display(linear)

    def slope(self, linear: Array) -> Array:
        """See `ChannelResponse`."""
        return self.view.display_slope(linear)


@dataclass(frozen=True)
class DisplayedMixed:
    """sRGB display values through a view that mixes channels."""

    view: View

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return self.view.display(linear)

    def pullback(self, linear: Array, gradient: Array) -> Array:
        """See `Response`."""
        return self.view.display_pullback(linear, gradient)

    def push(self, linear: Array, tangent: Array) -> Array:
        """See `Response`."""
        return self.view.display_push(linear, tangent)


def displayed_by(view: View) -> Response:
    """sRGB display values through a view, channel by channel where it allows that."""
    return Displayed(view) if isinstance(view, DisplayView) else DisplayedMixed(view)


@dataclass(frozen=True)
class OnDisplay:
    """A response to the light of a display that shows the radiance through a view."""

    view: View
    response: Response

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return self.response.apply(self.view.light(linear))

    def pullback(self, linear: Array, gradient: Array) -> Array:
        """See `Response`."""
        return self.view.light_pullback(linear, self.response.pullback(self.view.light(linear), gradient))

    def push(self, linear: Array, tangent: Array) -> Array:
        """See `Response`."""
        return self.response.push(self.view.light(linear), self.view.light_push(linear, tangent))


# Part of the mean radiance that counts as dim: relative differences are of radiance and this, so that pixels that are
# nearly black do not decide. Larger: shadows count less. Smaller: their noise decides. A metal under one lamp has a
# median of a thousandth of its mean, and its dark part outweighed its highlight (docs/notebook/hard_cases.md).
DIM_FLOOR = 0.1


def relative_to(reference: Array) -> Scaled:
    """Radiance relative to the reference's own, with a floor of 1 % of its mean under dark pixels."""
    floor = 0.01 * _mean(reference)
    return Scaled((1 / np.sqrt(np.square(reference) + floor**2)).astype(reference.dtype))


def logarithmic_for(reference: Array) -> Logarithmic:
    """The logarithmic response whose toe is a tenth of the reference's mean."""
    return Logarithmic(DIM_FLOOR * _mean(reference))


def nits_per_unit(reference: Array, mask: NDArray[np.bool_] | None = None, median_nits: float = 100.0) -> float:
    """Candela per square metre for a radiance of 1, with the median of the lit (or masked) pixels at 100."""
    values = luminance(np.maximum(reference, 0))
    values = values[values > 0] if mask is None else values[mask]
    median = float(np.median(values)) if values.size else 0.0
    return median_nits / median if median > 0 else median_nits


def _mean(reference: Array) -> float:
    return max(float(np.mean(np.maximum(reference, 0), dtype=np.float64)), 1e-12)
