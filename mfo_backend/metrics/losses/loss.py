# SPDX-License-Identifier: Apache-2.0
"""The losses a fit can minimise, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from ...types.image import Encoding, Image, Pixels
from ..display.colour import linear_from_srgb, srgb_from_linear
from ..display.tone_mapping import DisplayView, View
from ..flip.exposure_range import lit_exposures
from ..pixels.pixel_check import check_finite, check_mask
from ..responses.itp import Itp
from ..responses.pu21 import Pu21
from ..responses.response import OnDisplay, Response, Scaled, displayed_by, logarithmic_for, nits_per_unit, relative_to
from .flip_loss import FlipLoss, HdrFlipLoss
from .loss_names import LOSS_NAMES, OPTIONAL_HDR_LOSSES, OPTIONAL_LDR_LOSSES, OPTIONAL_LOSS_NAMES
from .optional_losses import hdr_perceptual_loss, ldr_perceptual_loss
from .squared_loss import SquaredLoss

__all__ = ["DISPLAY_NITS", "LOSS_NAMES", "OPTIONAL_LOSS_NAMES", "Loss", "ResidualLoss", "make_loss", "squared_response"]

DISPLAY_NITS = 100.0  # white of a display in cd/m^2 (IEC 61966-2-1 has 80, a usual monitor is set brighter)

# Squared losses by kind. Their response is a function of light in cd/m^2 ...
ABSOLUTE_RESPONSES: dict[str, Callable[[float], Response]] = {"pu21": Pu21, "itp": Itp}
# ... or, for scene-linear pixels, of the reference and the pixels that see the object
HDR_RESPONSES: dict[str, Callable[[Pixels, NDArray[np.bool_] | None], Response]] = {
    "mse": lambda target, mask: Scaled(),
    "log": lambda target, mask: logarithmic_for(target),
    "relative": lambda target, mask: relative_to(target),
    "pu21": lambda target, mask: Pu21(nits_per_unit(target, mask)),
    "itp": lambda target, mask: Itp(nits_per_unit(target, mask)),
}


class Loss(Protocol):
    """A difference to one reference. Images are scene-linear float32 (height, width, 3), gradients alike."""

    name: str

    def value(self, image: Pixels) -> float:
        """The loss of an image."""
        ...

    def value_and_gradient(self, image: Pixels) -> tuple[float, Pixels]:
        """The loss and its gradient with respect to the image, finite everywhere."""
        ...


class ResidualLoss(Loss, Protocol):
    """A loss that is a sum of squares, so that least squares can minimise it."""

    def residual(self, image: Pixels) -> Pixels:
        """The vector (height * width * 3,) whose squares sum to `value(image)`."""
        ...

    def residual_jacobian(self, image: Pixels, tangents: Pixels) -> Pixels:
        """Its derivative (height * width * 3, count) along image derivatives (count, height, width, 3)."""
        ...


def make_loss(
    name: str, reference: Image, *, mask: NDArray[np.bool_] | None = None, display: View | None = None
) -> Loss:
    """The loss `name` against `reference`.

    Parameters
    ----------
    name
        One of `LOSS_NAMES` or `OPTIONAL_LOSS_NAMES`. The LDR losses compare what a display shows, the HDR losses
        scene-linear values; ``lpips_*-hdr`` is LPIPS(PU). The squared ones of `LOSS_NAMES`, which are all but FLIP,
        are `ResidualLoss` as well.
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
    SetupError
        If an optional loss lacks its package or weights.
    """
    if name not in LOSS_NAMES + OPTIONAL_LOSS_NAMES:
        raise BadInputError(f"Unknown loss {name!r}: choose one of {', '.join(LOSS_NAMES + OPTIONAL_LOSS_NAMES)}.")
    check_finite(reference.pixels, "The reference")
    if mask is not None:
        check_mask(mask, reference.pixels.shape[:2])
    target = np.maximum(reference.pixels, 0)
    kind, dynamic_range = name.split("-")
    if dynamic_range == "hdr":
        if reference.encoding is not Encoding.LINEAR:
            raise BadInputError(
                f"Loss {name} needs a scene-linear reference (EXR or HDR), but this one holds display values: "
                f"use {'flip-ldr' if kind == 'flip' else 'mse-ldr'} or a linear reference."
            )
        if kind == "flip":
            return HdrFlipLoss(name, target, lit_exposures(target, mask))
        if name in OPTIONAL_HDR_LOSSES:
            return hdr_perceptual_loss(name, target, nits_per_unit(target, mask))
        response = HDR_RESPONSES[kind](target, mask)
        return SquaredLoss(name, response.apply(target), response)

    if reference.encoding is Encoding.SRGB:
        view = display or DisplayView()
        light = linear_from_srgb(np.minimum(target, 1))
    else:
        view = display or DisplayView.for_scene(target, mask)
        light = view.light(target)
    if kind == "flip":
        return FlipLoss(name, light, view)
    if kind == "mse":
        return SquaredLoss(name, srgb_from_linear(light), displayed_by(view))
    if name in OPTIONAL_LDR_LOSSES:
        return ldr_perceptual_loss(name, light, view, DISPLAY_NITS)
    on_light = ABSOLUTE_RESPONSES[kind](DISPLAY_NITS)
    return SquaredLoss(name, on_light.apply(light), OnDisplay(view, on_light))


def squared_response(name: str, light: Pixels, mask: NDArray[np.bool_] | None, view: View) -> Response:
    """What the loss of this name takes the squared differences of, as a function of scene-linear pixels.

    Parameters
    ----------
    name
        A loss that is a sum of squares, as `make_loss` has it.
    light, mask
        The reference as scene-linear radiance (height, width, 3), and its pixels that see the object.
    view
        What an LDR loss looks through.

    Raises
    ------
    BadInputError
        If the loss is no sum of squares.
    """
    kind, dynamic_range = name.split("-")
    if dynamic_range == "hdr" and kind in HDR_RESPONSES:
        return HDR_RESPONSES[kind](light, mask)
    if name == "mse-ldr":
        return displayed_by(view)
    if dynamic_range == "ldr" and kind in ABSOLUTE_RESPONSES:
        return OnDisplay(view, ABSOLUTE_RESPONSES[kind](DISPLAY_NITS))
    raise BadInputError(f"Loss {name} is no sum of squares: only a stage that minimises it by its gradient can use it.")
