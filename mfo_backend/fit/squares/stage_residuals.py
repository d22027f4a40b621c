# SPDX-License-Identifier: Apache-2.0
"""The stages that follow the least squares of a fit: squares of named losses of the same pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import View
from ...metrics.losses.loss import squared_response
from ...types.image import Encoding, Pixels
from ..settings import FitSettings
from .residuals import MakeResidual, RelativeResidual, ResponseResidual


def finishing_residuals(
    settings: FitSettings, encoding: Encoding, light: Pixels, mask: NDArray[np.bool_], view: View
) -> dict[str, MakeResidual]:
    """How to make the residuals of each stage, by its name, in order.

    Those are the settings' losses; without them `fast` has none and the other presets have dE_ITP, before which a
    display picture has its own values.

    Parameters
    ----------
    light, mask
        The reference as scene-linear pixels and those of them that see the target.
    view
        What display losses look through.

    Raises
    ------
    BadInputError
        If a loss is not defined for a reference of this encoding.
    """
    if settings.losses is not None:
        names = settings.stage_names(encoding)
        return {name: _residual(name, light, mask, view) for name in names}
    if settings.preset == "fast":
        return {}
    if encoding is Encoding.SRGB or settings.range == "ldr":
        return {"display": _residual("mse-ldr", light, mask, view), "itp": _residual("itp-ldr", light, mask, view)}
    return {"itp": _residual("itp-hdr", light, mask, view)}


def _residual(name: str, light: Pixels, mask: NDArray[np.bool_], view: View) -> MakeResidual:
    if name == "relative-hdr":  # relative to each pixel, so its response is none of a group of them
        return RelativeResidual
    response = squared_response(name, light, mask, view)
    return lambda target: ResponseResidual(response, target)
