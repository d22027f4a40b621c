# SPDX-License-Identifier: Apache-2.0
"""The stages that follow `refine` in a recorded fit: least squares on other residuals of the same recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...metrics.itp import Itp
from ...metrics.loss import DISPLAY_NITS
from ...metrics.pu21 import Pu21
from ...metrics.response import OnDisplay, Response, Scaled, displayed_by, logarithmic_for, nits_per_unit
from ...metrics.tone_mapping import View
from ...types.image import Encoding, Pixels
from ..settings import FitSettings
from .residuals import MakeResidual, RelativeResidual, ResponseResidual


def finishing_residuals(
    settings: FitSettings, encoding: Encoding, light: Pixels, mask: NDArray[np.bool_], view: View
) -> dict[str, MakeResidual]:
    """How to make the residuals of each stage, by its name, in order.

    Those are the settings' losses; without them `fast` has none and the other presets have two perceptual ones.

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
    return {"itp": _residual("itp-hdr", light, mask, view), "pu21": _residual("pu21-hdr", light, mask, view)}


def _residual(name: str, light: Pixels, mask: NDArray[np.bool_], view: View) -> MakeResidual:
    if name == "relative-hdr":
        return RelativeResidual
    response = _response(name, light, mask, view)
    return lambda target: ResponseResidual(response, target)


def _response(name: str, light: Pixels, mask: NDArray[np.bool_], view: View) -> Response:
    """What the loss of this name squares the differences of, as `metrics.loss.make_loss` has it."""
    kind, dynamic_range = name.split("-")
    if name == "mse-hdr":
        return Scaled()
    if name == "log-hdr":
        return logarithmic_for(light)
    if name == "mse-ldr":
        return displayed_by(view)
    ldr = dynamic_range == "ldr"
    nits = DISPLAY_NITS if ldr else nits_per_unit(light, mask)
    response = Pu21(nits) if kind == "pu21" else Itp(nits)
    return OnDisplay(view, response) if ldr else response
