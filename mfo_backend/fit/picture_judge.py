# SPDX-License-Identifier: Apache-2.0
"""The measure that counts for `balanced` and `best`: FLIP over the target, below the noise where there is some."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..metrics.loss import Loss
from ..metrics.tone_mapping import View
from ..types.image import Encoding, Image, Pixels
from .settings import FitSettings
from .verification import stage_losses

BLUR = 2.0  # pixels: takes nine tenths of independent noise away and little of what few global values change
NOISY = 0.02  # noise of a pixel relative to its radiance that FLIP sees


class PictureJudge:
    """The loss `name`, such as ``flip-hdr``, of linear pictures against a reference.

    With `blurred`, picture and reference are blurred inside the mask first: the FLIP of independent noise is a large
    number that says nothing of the material, and being no square it shifts the best values, too.
    """

    def __init__(
        self,
        name: str,
        reference: Image,
        background: Pixels,
        mask: NDArray[np.bool_],
        settings: FitSettings,
        view: View,
        *,
        blurred: bool,
    ) -> None:
        self._blur = _MaskedBlur(mask) if blurred else None
        if self._blur is not None:
            # display values cannot be averaged where they are clipped
            assert reference.encoding is Encoding.LINEAR
            pixels = self._blur(np.maximum(reference.pixels, 0.0)).astype(np.float32)
            reference = Image(pixels, Encoding.LINEAR)
        self._loss: Loss = stage_losses([name], reference, background, mask, settings, view)[0]

    def value(self, image: Pixels) -> float:
        """The mean error of a linear picture."""
        return self._loss.value(image if self._blur is None else self._blur(image))

    def value_and_gradient(self, image: Pixels) -> tuple[float, Pixels]:
        """The mean error and its gradient with respect to the picture."""
        if self._blur is None:
            return self._loss.value_and_gradient(image)
        value, gradient = self._loss.value_and_gradient(self._blur(image))
        return value, self._blur.pullback(gradient)


class _MaskedBlur:
    """A Gaussian mean over the pixels of a mask; other pixels stay as they are."""

    def __init__(self, mask: NDArray[np.bool_]) -> None:
        self._mask = mask[..., None]
        weight = self._gaussian(mask[..., None].astype(np.float32))
        self._scale = np.where(self._mask, 1.0 / np.maximum(weight, 1e-6), 0.0).astype(np.float32)

    def __call__(self, image: Pixels) -> Pixels:
        inside = np.where(self._mask, image, np.float32(0.0))
        return np.where(self._mask, self._gaussian(inside) * self._scale, image)

    def pullback(self, gradient: Pixels) -> Pixels:
        """The adjoint: zero padding makes the Gaussian symmetric."""
        return np.where(self._mask, self._gaussian(gradient * self._scale), gradient)

    @staticmethod
    def _gaussian(image: Pixels) -> Pixels:
        from scipy.ndimage import gaussian_filter

        return np.asarray(gaussian_filter(image, (BLUR, BLUR, 0.0), mode="constant", truncate=3.0), np.float32)
