# SPDX-License-Identifier: Apache-2.0
"""The mean squared error of scene-linear or displayed values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .tone_mapping import DisplayView

Array = NDArray[np.floating]


def mean_squared_error(reference: Array, test: Array) -> float:
    """Mean over pixels and channels of the squared difference, accumulated in float64."""
    return float(np.mean(np.square(np.subtract(test, reference, dtype=np.float64))))


class MseLoss:
    """Mean squared error against `target`: linear values, or display values when a `view` is given."""

    def __init__(self, name: str, target: Array, view: DisplayView | None = None) -> None:
        self.name = name
        self._target = target
        self._view = view

    def value(self, image: Array) -> float:
        """The error of a scene-linear image."""
        return mean_squared_error(self._target, self._seen(image))

    def value_and_gradient(self, image: Array) -> tuple[float, Array]:
        """The error of a scene-linear image and its gradient with respect to that image."""
        seen = self._seen(image)
        gradient = (seen - self._target) * seen.dtype.type(2 / seen.size)
        if self._view is not None:
            gradient = self._view.display_pullback(image, gradient)
        return mean_squared_error(self._target, seen), gradient.astype(image.dtype, copy=False)

    def _seen(self, image: Array) -> Array:
        return image if self._view is None else self._view.display(image)
