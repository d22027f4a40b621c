# SPDX-License-Identifier: Apache-2.0
"""From pixels and their Jacobian to normal equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.baked_view import BakedView
from ...metrics.responses.response import ChannelResponse, Logarithmic, Response
from ...solve.bounded_least_squares import NormalEquations
from ...types.parameter import Vector
from ..tolerances import DIM_FLOOR, MODEL_ERROR

Rows = NDArray[np.float32]
ImageAndJacobian = Callable[[Vector], Rows]  # (g, 3, 1 + k): the image and its derivatives
# Display values a stop; where a display shows no more, this alone leads back. A level of 8 bits is 0.004, so two
# pictures that both stay below white differ by nothing else
_ABOVE_WHITE = 0.05


class Residual(Protocol):
    """The signed difference of an image (g, 3) to a reference, and its derivative by the image.

    The derivative is (g, 3) when each output depends on its own channel only, else (g, 3 outputs, 3 channels).
    """

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """Values (g, 3) and derivative."""
        ...


MakeResidual = Callable[[Rows], Residual]  # from a reference


class ResponseResidual:
    """The difference of a pointwise response to image and reference (g, 3)."""

    def __init__(self, response: Response, reference: Rows) -> None:
        self._response = response
        self._target = response.apply(reference)

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`."""
        values = self._response.apply(image) - self._target
        if isinstance(self._response, ChannelResponse):
            return values, self._response.slope(image)
        unit = np.broadcast_to(np.eye(3, dtype=image.dtype)[:, None, :], (3, *image.shape))
        return values, np.moveaxis(self._response.push(image, unit), 0, 2)


def log_residual(reference: Rows) -> ResponseResidual:
    """log(1 + 3 L / median): compressive, so highlights and shadows both count; the median lies mid-curve.

    The median counts as a tenth of the mean at least (`DIM_FLOOR`). A metal under one lamp is black but for its
    highlight: there a smaller scale would weigh differences that nobody sees as much as the highlight.
    """
    lit = reference[reference > 0.0]
    median = max(float(np.median(lit)), DIM_FLOOR * float(lit.mean())) if lit.size else 1.0
    return ResponseResidual(Logarithmic(median / 3.0), reference)


class RelativeResidual:
    """(I - R) / (I + 0.1 mean R), the weight held constant in the derivative.

    Unbiased under noise of the reference, where a compressive residual is not: the weight may not come from noisy
    pixels.
    """

    def __init__(self, reference: Rows) -> None:
        self._reference = reference
        self._floor = np.float32(max(DIM_FLOOR * float(reference.mean()), 1e-12))

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`."""
        weight = 1.0 / (np.maximum(image, 0.0) + self._floor)
        return (image - self._reference) * weight, weight


class WeightedResidual:
    """(I - R) x `weight`, both (g, 3), growing only like the root of a logarithm beyond `LIMIT` standard deviations.

    A weight is one over the deviation of the noise. The influence of a residual falls beyond the limit, so that one
    firefly in the reference outweighs neither its neighbours nor what is known of the noise.
    """

    LIMIT = 4.0

    def __init__(self, reference: Rows, weight: Rows) -> None:
        self._reference = reference
        self._weight = weight.astype(np.float32)

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`."""
        values, change = _bounded((image - self._reference) * self._weight, self.LIMIT)
        return values, self._weight * change


def _bounded(values: Rows, limit: float) -> tuple[Rows, Rows]:
    """Values that grow only like the root of a logarithm beyond a limit, and their derivative by the values given."""
    size = np.maximum(np.abs(values), limit)
    bounded = limit * np.sqrt(1.0 + 2.0 * np.log(size / limit))
    far = size > limit
    return np.where(far, np.copysign(bounded, values), values), np.where(far, limit**2 / (size * bounded), 1.0)


class CensoredResidual:
    """Another residual that does not look above `limit` where the reference (g, 3) is clipped there.

    Elsewhere the image stays unclipped: a clipped one would have no slope to come back by.
    """

    def __init__(self, residual: Residual, reference: Rows, limit: float) -> None:
        self._residual = residual
        self._limit = np.float32(limit)
        self._clipped = reference >= 0.99 * limit

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`."""
        over = self._clipped & (image > self._limit)
        values, slope = self._residual(np.where(over, self._limit, image))
        return values, slope * np.where(over, np.float32(0.0), np.float32(1.0))


class OneSidedResidual:
    """Another residual that does not look above the reference where `at_least` (g, 3) says that it is a lower bound.

    Such is the mean of pixels some of which are clipped.
    """

    def __init__(self, residual: Residual, at_least: NDArray[np.bool_]) -> None:
        self._residual = residual
        self._at_least = at_least

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`."""
        values, slope = self._residual(image)
        keep = ~(self._at_least & (values > 0))
        return values * keep, slope * (keep if slope.ndim == 2 else keep[..., None])


def residual_rows(table: Rows, residual: Residual) -> NDArray[np.float64]:
    """Values and derivatives (g, 3, 1 + k) of the residual from those of the image."""
    return rows_and_slope(table, residual)[0]


def rows_and_slope(table: Rows, residual: Residual) -> tuple[NDArray[np.float64], Rows]:
    """The same, and the residual's derivative by the image."""
    values, slope = residual(table[:, :, 0])
    rows = sloped(table, slope)
    rows[:, :, 0] = values
    return rows, slope


def sloped(table: Rows, slope: Rows) -> NDArray[np.float64]:
    """Rows of image and derivatives (g, 3, 1 + k) times the derivative of a residual by the image."""
    if slope.ndim == 2:
        return np.multiply(table, slope[..., None], dtype=np.float64)
    return np.matmul(slope, table).astype(np.float64)


def normal_equations(evaluate: ImageAndJacobian, residual: Residual) -> Callable[[Vector], NormalEquations]:
    """The least-squares problem of `residual` over the images of `evaluate`, per residual; sums in float64."""

    def at(x: Vector) -> NormalEquations:
        gram = gram_of(residual_rows(evaluate(x), residual))
        return NormalEquations(0.5 * float(gram[0, 0]), gram[1:, 0], gram[1:, 1:])

    return at


def gram_of(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean products (1 + k, 1 + k) of the columns of rows (g, 3, 1 + k)."""
    rows = rows.reshape(-1, rows.shape[-1])
    return (rows.T @ rows) / len(rows)


class DisplayedResidual:
    """The difference of display values to those of a reference (g, 3), with a slope where the image is above white.

    Where the reference is clipped, an image that is brighter still agrees with it.
    """

    def __init__(self, view: BakedView, reference: Rows) -> None:
        self._view = view
        self._target = view.display(reference)
        self._clipped = self._target >= view.top
        self._white = view.white.astype(reference.dtype)

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`; the derivative is (g, 3 outputs, 3 channels)."""
        shown, jacobian = self._view.display_jacobian(image)
        values = shown - self._target
        agrees = self._clipped & (values >= 0)
        above = ~self._clipped & (image > self._white)
        safe = np.maximum(image, self._white)
        values += _ABOVE_WHITE * np.log2(safe / self._white) * above
        jacobian[np.broadcast_to(np.eye(3, dtype=bool), jacobian.shape)] += (
            above * (_ABOVE_WHITE / np.log(2)) / safe
        ).ravel()
        values[agrees] = 0
        jacobian[agrees] = 0
        return values, jacobian


class WeightedDisplayedResidual:
    """A `DisplayedResidual` in standard deviations of the noise, bounded like `WeightedResidual`.

    `weight` (g, 3) is one over the deviation of the noise in radiance. What a display shows of that noise follows from
    the view's slopes at the reference; it is `MODEL_ERROR` at least, for a level of 8 bits is as much.
    """

    def __init__(self, view: BakedView, reference: Rows, weight: Rows) -> None:
        self._shown = DisplayedResidual(view, reference)
        slopes = view.display_jacobian(reference)[1]
        noise = np.sqrt(np.square(slopes / weight[:, None, :]).sum(axis=-1))
        self._weight = (1.0 / np.hypot(noise, MODEL_ERROR)).astype(np.float32)

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `Residual`; the derivative is (g, 3 outputs, 3 channels)."""
        values, jacobian = self._shown(image)
        values, change = _bounded(values * self._weight, WeightedResidual.LIMIT)
        return values, jacobian * (self._weight * change)[..., None]
