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


def check_reference(reference: Image, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Those pixels of `mask`, which see the target, that count.

    Raises
    ------
    BadInputError
        Unless the reference has the size of `mask`, and shows something in a pixel of the target that counts.
    """
    height, width = mask.shape
    if (reference.height, reference.width) != (height, width):
        raise BadInputError(
            f"Reference is {reference.width}x{reference.height} but the scene renders {width}x{height}: "
            "give a picture of that size or change the render resolution."
        )
    if not mask.any():
        raise BadInputError("The camera does not see the target: move the camera or unhide the object.")
    if reference.counts is not None:
        mask, whole = mask & reference.counts, mask
        if not mask.any():
            raise BadInputError(
                f"The part of the reference that counts shows nothing of the target, which {whole.sum()} other pixels "
                "see: choose a part that holds some of the object, or let the whole picture count."
            )
    if not reference.pixels[mask].any():
        raise BadInputError("The reference is black where the target is: check the picture and its light.")
    return mask


def stage_losses(
    names: Sequence[str],
    reference: Image,
    background: Pixels,
    mask: NDArray[np.bool_],
    settings: FitSettings,
    display: View | None,
) -> list[Loss]:
    """The named losses over the settings' region, `background` standing in outside of it."""
    if settings.region == "image" and reference.counts is None:
        return [make_loss(name, reference, mask=mask, display=display) for name in names]
    counted = counted_pixels(reference, mask, settings)
    shown = fill_outside(reference, background, counted, (display or DisplayView()).display)
    return [MaskedLoss(make_loss(name, shown, mask=mask, display=display), background, counted) for name in names]


def counted_pixels(reference: Image, mask: NDArray[np.bool_], settings: FitSettings) -> NDArray[np.bool_]:
    """Those of a reference that count in the settings' region, of which `mask` sees the target."""
    if settings.region != "image":
        return mask
    return np.ones_like(mask) if reference.counts is None else reference.counts
