# SPDX-License-Identifier: Apache-2.0
"""A judge as a loss: a distance between what a display shows of the image and of the reference."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..pixels.pixel_check import check_image
from ..responses.response import Response

Array = NDArray[np.floating]


class Distance(Protocol):
    """A distance (0 where equal) of an array (height, width, 3) to one reference."""

    def value(self, test: Array) -> float:
        """The distance."""
        ...

    def value_and_gradient(self, test: Array) -> tuple[float, Array]:
        """The distance and its gradient with respect to `test`."""
        ...


class PerceptualLoss:
    """`distance` of the response to a scene-linear image of `shape` (height, width, 3)."""

    def __init__(self, name: str, shape: tuple[int, ...], response: Response, distance: Distance) -> None:
        self.name = name
        self._shape = shape
        self._response = response
        self._distance = distance

    def value(self, image: Array) -> float:
        """The loss of a scene-linear image."""
        check_image(image, self._shape)
        return self._distance.value(self._response.apply(image))

    def value_and_gradient(self, image: Array) -> tuple[float, Array]:
        """The loss of a scene-linear image and its gradient with respect to that image."""
        check_image(image, self._shape)
        value, gradient = self._distance.value_and_gradient(self._response.apply(image))
        return value, self._response.pullback(image, gradient).astype(image.dtype, copy=False)
