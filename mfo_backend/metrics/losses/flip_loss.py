# SPDX-License-Identifier: Apache-2.0
"""Mean LDR-FLIP and mean HDR-FLIP as losses of a scene-linear image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..display.tone_mapping import View
from ..flip.exposure_range import ExposureRange
from ..flip.flip_filters import DEFAULT_PIXELS_PER_DEGREE
from ..flip.flip_reference import FlipComparison, FlipReference, comparisons
from ..flip.hdr_flip import HdrFlip
from ..flip.ldr_flip import pixels_of, planes_of
from ..pixels.pixel_check import check_image

Array = NDArray[np.floating]


class FlipLoss:
    """Mean LDR-FLIP of a scene-linear image seen through `view` against the light `target` of a display, in [0, 1]."""

    def __init__(
        self, name: str, target: Array, view: View, pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE
    ) -> None:
        self.name = name
        self._view = view
        self._shape = target.shape
        self._dtype = target.dtype
        self._reference = FlipReference(planes_of(target), pixels_per_degree)

    def value(self, image: Array) -> float:
        """The mean error."""
        return float(self._compare(image).error.mean(dtype=np.float64))

    def value_and_gradient(self, image: Array) -> tuple[float, Array]:
        """The mean error and its gradient with respect to the scene-linear image."""
        comparison = self._compare(image)
        weight = np.full_like(comparison.error, 1 / comparison.error.size)
        gradient = self._view.light_pullback(image, pixels_of(comparison.pullback(weight)))
        return float(comparison.error.mean(dtype=np.float64)), gradient.astype(image.dtype, copy=False)

    def _compare(self, image: Array) -> FlipComparison:
        check_image(image, self._shape)
        light = self._view.light(image).astype(self._dtype, copy=False)
        return next(comparisons([self._reference], planes_of(light)))


class HdrFlipLoss:
    """Mean HDR-FLIP of a scene-linear image against a scene-linear `target`."""

    def __init__(
        self,
        name: str,
        target: Array,
        exposures: ExposureRange,
        pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE,
    ) -> None:
        self.name = name
        self._shape = target.shape
        self._flip = HdrFlip(target, exposures=exposures, pixels_per_degree=pixels_per_degree)

    def value(self, image: Array) -> float:
        """The mean error."""
        check_image(image, self._shape)
        return float(self._flip.map(image).mean(dtype=np.float64))

    def value_and_gradient(self, image: Array) -> tuple[float, Array]:
        """The mean error and its gradient with respect to the image."""
        check_image(image, self._shape)
        error, gradient = self._flip.map_and_pullback(image, 1 / (image.shape[0] * image.shape[1]))
        return float(error.mean(dtype=np.float64)), gradient.astype(image.dtype, copy=False)
