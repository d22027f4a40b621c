# SPDX-License-Identifier: Apache-2.0
"""What every preset checks before a fit, and what it looks at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import DisplayView, View
from ...metrics.losses.loss import Loss, make_loss
from ...types.errors import BadInputError
from ...types.image import Image, Pixels
from ..settings import FitSettings
from .region import MaskedLoss, fill_outside


def check_reference(reference: Image, mask: NDArray[np.bool_]) -> None:
    """Raise `BadInputError` unless the reference has the size of `mask` and shows something where the target is."""
    height, width = mask.shape
    if (reference.height, reference.width) != (height, width):
        raise BadInputError(
            f"Reference is {reference.width}x{reference.height} but the scene renders {width}x{height}: "
            "give a picture of that size or change the render resolution."
        )
    if not mask.any():
        raise BadInputError("The camera does not see the target: move the camera or unhide the object.")
    if not reference.pixels[mask].any():
        raise BadInputError("The reference is black where the target is: check the picture and its light.")


def stage_losses(
    names: Sequence[str],
    reference: Image,
    background: Pixels,
    mask: NDArray[np.bool_],
    settings: FitSettings,
    display: View | None,
) -> list[Loss]:
    """The named losses over the settings' region, `background` standing in outside of it."""
    if settings.region == "image":
        return [make_loss(name, reference, mask=mask, display=display) for name in names]
    shown = fill_outside(reference, background, mask, (display or DisplayView()).display)
    return [MaskedLoss(make_loss(name, shown, mask=mask, display=display), background, mask) for name in names]


def counted_pixels(mask: NDArray[np.bool_], settings: FitSettings) -> NDArray[np.bool_]:
    """Those of a picture that the settings' region holds, of which `mask` sees the target."""
    return np.ones_like(mask) if settings.region == "image" else mask
