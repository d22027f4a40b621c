# SPDX-License-Identifier: Apache-2.0
"""The measure that counts for `balanced` and `best`: FLIP over the target, below the noise where there is some."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import DisplayView, View
from ...metrics.flip.block_means import block_means, block_side, block_sums, full_blocks, spread
from ...metrics.losses.loss import Loss
from ...types.image import Encoding, Image, Pixels
from ..settings import FitSettings
from .beyond_noise import BLUR
from .checked_reference import counted_pixels, stage_losses
from .region import fill_outside


class PictureJudge:
    """The loss `name`, such as ``flip-hdr``, of linear pictures against a reference.

    Where many pixels count, pictures are compared at a fraction of their size, as their errors are
    (`fit.judge.picture_errors`). With `blurred`, picture and reference are blurred inside the mask first: the FLIP of
    independent noise is a large number that says nothing of the material, and being no square it shifts the best
    values, too.
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
        counted = counted_pixels(reference, mask, settings)
        side = block_side(counted)
        self._smaller: _Smaller | None = None
        if side > 1:
            display = view if reference.encoding is Encoding.SRGB else None
            self._smaller = _Smaller(background, counted, side, display)
            reference = block_means(fill_outside(reference, background, counted, view.display), side)
            background, mask = self._smaller(background), full_blocks(mask, side)
            view = view if display is None else DisplayView()
        self._blur = _MaskedBlur(mask) if blurred else None
        if self._blur is not None:
            # display values cannot be averaged where they are clipped
            assert reference.encoding is Encoding.LINEAR
            pixels = self._blur(np.maximum(reference.pixels, 0.0)).astype(np.float32)
            reference = Image(pixels, Encoding.LINEAR)
        self._loss: Loss = stage_losses([name], reference, background, mask, settings, view)[0]

    def value(self, image: Pixels) -> float:
        """The mean error of a linear picture."""
        return self._loss.value(self._seen(image))

    def value_and_gradient(self, image: Pixels) -> tuple[float, Pixels]:
        """The mean error and its gradient with respect to the picture."""
        value, gradient = self._loss.value_and_gradient(self._seen(image))
        if self._blur is not None:
            gradient = self._blur.pullback(gradient)
        return value, gradient if self._smaller is None else self._smaller.pullback(image, gradient)

    def _seen(self, image: Pixels) -> Pixels:
        if self._smaller is not None:
            image = self._smaller(image)
        return image if self._blur is None else self._blur(image)


class _Smaller:
    """Means of light over blocks of pixels, of `background` outside of a mask.

    The light is radiance, or what a display emits that shows it through `view`.
    """

    def __init__(self, background: Pixels, mask: NDArray[np.bool_], side: int, view: View | None) -> None:
        self._background, self._mask, self._side, self._view = background, mask[..., None], side, view

    def __call__(self, image: Pixels) -> Pixels:
        light = np.where(self._mask, image, self._background)
        if self._view is not None:
            light = self._view.light(light)
        return (block_sums(light, self._side) / self._side**2).astype(np.float32)

    def pullback(self, image: Pixels, gradient: Pixels) -> Pixels:
        """The adjoint of its derivative at a picture."""
        whole = np.where(self._mask, spread(gradient, self._side, image.shape), np.float32(0.0))
        return whole if self._view is None else self._view.light_pullback(image, whole)


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
