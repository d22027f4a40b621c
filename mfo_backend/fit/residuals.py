# SPDX-License-Identifier: Apache-2.0
"""From pixels and their Jacobian to normal equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..solve.bounded_least_squares import NormalEquations

Vector = NDArray[np.float64]
Rows = NDArray[np.float32]
ImageAndJacobian = Callable[[Vector], Rows]  # (g, 3, 1 + k): the image and its derivatives


class Residual(Protocol):
    """The signed difference of an image (g, 3) to a reference, and its derivative by the image.

    The derivative is (g, 3) when each output depends on its own channel only, else (g, outputs, 3).
    """

    name: str

    def __call__(self, image: Rows) -> tuple[Rows, Rows]: ...


class LogResidual:
    """log(1 + k L / m) with m the median of the reference: compressive, so highlights and shadows both count.

    k = 3 puts the median near the middle of the curve.
    """

    name = "log"

    def __init__(self, reference: Rows, k: float = 3.0) -> None:
        positive = reference[reference > 0.0]
        if len(positive) == 0:
            positive = np.ones(1, np.float32)
        self.gain = np.float32(k / np.median(positive))
        self._target = np.log1p(self.gain * np.maximum(reference, 0.0))

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        scaled = 1.0 + self.gain * np.maximum(image, 0.0)
        return np.log(scaled) - self._target, self.gain / scaled


class RelativeResidual:
    """(I - R) / (I + 0.1 mean(R)) with the weight taken from the model image and held constant in the derivative.

    Unbiased under reference noise, where a compressive residual is not; the weight may not come from the noisy reference.
    """

    name = "relative"

    def __init__(self, reference: Rows) -> None:
        self._reference = reference
        self._floor = np.float32(max(0.1 * float(reference.mean()), 1e-12))

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        weight = 1.0 / (np.maximum(image, 0.0) + self._floor)
        return (image - self._reference) * weight, weight


def normal_equations(evaluate: ImageAndJacobian, residual: Residual) -> Callable[[Vector], NormalEquations]:
    """The least-squares problem of `residual` over the images of `evaluate`; sums in float64, divided by the residuals' number."""

    def at(x: Vector) -> NormalEquations:
        table = evaluate(x)
        values, slope = residual(table[:, :, 0])
        if slope.ndim == 2:
            rows = np.multiply(table, slope[..., None], dtype=np.float64)
        else:
            rows = np.matmul(slope, table).astype(np.float64)
        rows[:, :, 0] = values
        rows = rows.reshape(-1, rows.shape[-1])
        gram = (rows.T @ rows) / len(rows)
        return NormalEquations(0.5 * float(gram[0, 0]), gram[1:, 0], gram[1:, 1:])

    return at
