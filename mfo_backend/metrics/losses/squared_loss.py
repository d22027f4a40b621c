# SPDX-License-Identifier: Apache-2.0
"""Mean squared error of radiance, or of a pointwise response to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..pixels.pixel_check import check_image
from ..responses.response import Response

Array = NDArray[np.floating]


def mean_squared_error(reference: Array, test: Array) -> float:
    """Mean over pixels and channels of the squared difference, accumulated in float64."""
    return float(np.mean(np.square(np.subtract(test, reference, dtype=np.float64))))


class SquaredLoss:
    """Mean over pixels and channels of (response(image) - target)^2.

    Least squares can use it: `value(image)` is the squared length of `residual(image)`.

    Parameters
    ----------
    target
        The response to the reference, (height, width, 3).
    """

    def __init__(self, name: str, target: Array, response: Response) -> None:
        self.name = name
        self._target = target
        self._response = response

    def value(self, image: Array) -> float:
        """The loss of a scene-linear image."""
        check_image(image, self._target.shape)
        return mean_squared_error(self._target, self._response.apply(image))

    def value_and_gradient(self, image: Array) -> tuple[float, Array]:
        """The loss of a scene-linear image and its gradient with respect to that image."""
        check_image(image, self._target.shape)
        response = self._response.apply(image)
        gradient = (response - self._target) * response.dtype.type(2 / response.size)
        gradient = self._response.pullback(image, gradient)
        return mean_squared_error(self._target, response), gradient.astype(image.dtype, copy=False)

    def residual(self, image: Array) -> Array:
        """The differences of the responses, scaled so that their squares sum to the loss: (height * width * 3,)."""
        check_image(image, self._target.shape)
        difference = self._response.apply(image) - self._target
        return (difference / difference.size**0.5).ravel()

    def residual_jacobian(self, image: Array, tangents: Array) -> Array:
        """Derivative of `residual` along image derivatives (count, height, width, 3): (height * width * 3, count)."""
        pushed = self._response.push(image, tangents) / self._target.size**0.5
        return pushed.reshape(len(tangents), -1).T
