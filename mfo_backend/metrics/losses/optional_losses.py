# SPDX-License-Identifier: Apache-2.0
"""The losses that need optional packages: ColorVideoVDP and LPIPS."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..display.colour import srgb_from_linear
from ..display.tone_mapping import View
from ..responses.response import OnDisplay, Response, Scaled, displayed_by
from .perceptual_loss import Distance, PerceptualLoss

Array = NDArray[np.floating]


def hdr_perceptual_loss(name: str, target: Array, nits: float) -> PerceptualLoss:
    """A judge's distance to scene-linear `target`, with `nits` cd/m^2 for a radiance of 1.

    Raises
    ------
    SetupError
        If a package or a file of weights is missing.
    """
    kind = name.removesuffix("-hdr")
    if kind == "cvvdp":
        from ..judges.display_light import DisplayLight
        from ..judges.viewing import HDR_VIEWING

        response: Response = DisplayLight(nits, HDR_VIEWING.peak_nits)
        return PerceptualLoss(name, target.shape, response, _color_video_vdp(response.apply(target), hdr=True))
    from ..lpips.pu_values import PuValues

    response = PuValues(nits)
    return PerceptualLoss(name, target.shape, response, _lpips(kind, response.apply(target)))


def ldr_perceptual_loss(name: str, light: Array, view: View, nits: float) -> PerceptualLoss:
    """A judge's distance to the linear `light` in [0, 1] of a display whose white has `nits` cd/m^2.

    Raises
    ------
    SetupError
        If a package or a file of weights is missing.
    """
    kind = name.removesuffix("-ldr")
    if kind == "cvvdp":
        response: Response = OnDisplay(view, Scaled(nits))
        return PerceptualLoss(name, light.shape, response, _color_video_vdp(light * nits, hdr=False, white=nits))
    return PerceptualLoss(name, light.shape, displayed_by(view), _lpips(kind, srgb_from_linear(light)))


def _color_video_vdp(reference: Array, *, hdr: bool, white: float = 0.0) -> Distance:
    from ..judges.color_video_vdp import ColorVideoVdp
    from ..judges.viewing import HDR_VIEWING, SDR_VIEWING

    return ColorVideoVdp(reference, HDR_VIEWING if hdr else replace(SDR_VIEWING, peak_nits=white))


def _lpips(kind: str, reference: Array) -> Distance:
    from ..judges.packages import LPIPS, require_torch

    require_torch("LPIPS", LPIPS)
    from ..lpips.distance import Lpips

    return Lpips(kind.removeprefix("lpips_"), reference)
