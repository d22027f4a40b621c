# SPDX-License-Identifier: Apache-2.0
"""The losses a fit can minimise, by name."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from ..types.image import Encoding, Image, Pixels
from .colour import linear_from_srgb
from .exposure_range import lit_exposures
from .flip_loss import FlipLoss, HdrFlipLoss
from .mse import MseLoss
from .pixel_check import check_finite, check_mask, check_size
from .tone_mapping import DisplayView

LOSS_NAMES = ("mse-ldr", "mse-hdr", "flip-ldr", "flip-hdr")


class Loss(Protocol):
    """A difference to one reference. Images are scene-linear float32 (height, width, 3), gradients alike."""

    name: str

    def value(self, image: Pixels) -> float:
        """The loss of an image."""
        ...

    def value_and_gradient(self, image: Pixels) -> tuple[float, Pixels]:
        """The loss and its gradient with respect to the image, finite everywhere."""
        ...


def make_loss(
    name: str, reference: Image, *, mask: NDArray[np.bool_] | None = None, display: DisplayView | None = None
) -> Loss:
    """The loss `name` against `reference`.

    Parameters
    ----------
    name
        ``mse-ldr``, ``mse-hdr``, ``flip-ldr`` or ``flip-hdr``. The LDR losses compare what a display shows, the HDR
        losses scene-linear values.
    mask
        Pixels (height, width) that see the object; they choose exposures, the error is the mean over all pixels.
    display
        The view a display-referred reference was made with (by default Standard without exposure). For a scene-linear
        reference it defaults to a gamma curve exposed for the reference.

    Raises
    ------
    BadInputError
        For an unknown name, NaN or infinite pixels, a mask of another size or without pixels, or an HDR loss with
        display values. The loss itself raises it for an image of another size or with NaN or infinite pixels.
    """
    if name not in LOSS_NAMES:
        raise BadInputError(f"Unknown loss {name!r}: choose one of {', '.join(LOSS_NAMES)}.")
    check_finite(reference.pixels, "The reference")
    if mask is not None:
        check_mask(mask, reference.pixels.shape[:2])
    loss = _ldr_loss(name, reference, mask, display) if name.endswith("-ldr") else _hdr_loss(name, reference, mask)
    return _CheckedLoss(loss, reference.pixels.shape)


def _ldr_loss(name: str, reference: Image, mask: NDArray[np.bool_] | None, display: DisplayView | None) -> Loss:
    if reference.encoding is Encoding.SRGB:
        view = display or DisplayView()
        shown = np.clip(reference.pixels, 0, 1)
        light = linear_from_srgb(shown)
    else:
        view = display or DisplayView.for_scene(reference.pixels, mask)
        shown, light = view.display(reference.pixels), view.light(reference.pixels)
    return MseLoss(name, shown, view) if name == "mse-ldr" else FlipLoss(name, light, view)


def _hdr_loss(name: str, reference: Image, mask: NDArray[np.bool_] | None) -> Loss:
    if reference.encoding is not Encoding.LINEAR:
        raise BadInputError(
            f"Loss {name} needs a scene-linear reference (EXR or HDR), but this one holds display values: "
            f"use {name.replace('hdr', 'ldr')} or a linear reference."
        )
    target = np.maximum(reference.pixels, 0)
    return MseLoss(name, target) if name == "mse-hdr" else HdrFlipLoss(name, target, lit_exposures(target, mask))


class _CheckedLoss:
    """A loss that refuses images it is not defined for, so that no optimiser meets a NaN."""

    def __init__(self, loss: Loss, shape: tuple[int, ...]) -> None:
        self.name = loss.name
        self._loss = loss
        self._shape = shape

    def value(self, image: Pixels) -> float:
        self._check(image)
        return self._loss.value(image)

    def value_and_gradient(self, image: Pixels) -> tuple[float, Pixels]:
        self._check(image)
        return self._loss.value_and_gradient(image)

    def _check(self, image: Pixels) -> None:
        check_size(image, self._shape, "The rendered image")
        check_finite(image, "The rendered image")
