# SPDX-License-Identifier: Apache-2.0
"""What the judges say about two pictures, and what they were told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..types.errors import MfoError
from ..types.image import Encoding, Image
from .display.colour import linear_from_srgb
from .display.tone_mapping import DisplayView
from .flip.flip_error import shown
from .judges.color_video_vdp import color_video_vdp_jod
from .judges.display_light import DisplayLight
from .judges.hdr_vdp import hdr_vdp_q_jods
from .judges.hdr_vdp_program import is_configured
from .judges.viewing import HDR_VIEWING, SDR_VIEWING, Viewing
from .losses.loss import DISPLAY_NITS
from .pixels.pixel_check import check_pair
from .responses.response import nits_per_unit

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Judgement:
    """Scores of the judges for the whole picture, 10 being no difference.

    Attributes
    ----------
    jod
        ColorVideoVDP; None where it could not be computed.
    hdrvdp3_q_jod
        HDR-VDP-3, which ignores hue; None where it could not be computed or is not set up.
    conditions
        What both were told: size, display, pixels per degree, cd/m^2 for a value of 1.
    notes
        Conditions in words, and why a score is missing.
    """

    jod: float | None
    hdrvdp3_q_jod: float | None
    conditions: dict[str, Any]
    notes: tuple[str, ...]


def judge_images(reference: Image, test: Image, *, display: DisplayView | None = None) -> Judgement:
    """Both judges' scores of two pictures.

    Two scene-linear pictures are shown on ColorVideoVDP's standard HDR display with the median of the reference's lit
    pixels at 100 cd/m^2; if one holds display values, both are shown on a display with a white of 100 cd/m^2, linear
    ones through `display`.

    Raises
    ------
    BadInputError
        For pictures of different size or with NaN or infinite pixels.
    """
    check_pair(reference.pixels, test.pixels)
    if reference.encoding is Encoding.LINEAR and test.encoding is Encoding.LINEAR:
        viewing, nits = HDR_VIEWING, nits_per_unit(reference.pixels)
        light = DisplayLight(nits, viewing.peak_nits)
        a, b = (light.apply(image.pixels) for image in (reference, test))
    else:
        viewing, nits = replace(SDR_VIEWING, peak_nits=DISPLAY_NITS), DISPLAY_NITS
        view = display or DisplayView()
        a, b = (linear_from_srgb(np.clip(shown(image, view), 0, 1)) * nits for image in (reference, test))
    notes: list[str] = []
    jod = _score(lambda: color_video_vdp_jod(a, b, viewing), "ColorVideoVDP", notes)
    q_jod = None
    if is_configured():
        q_jod = _score(lambda: hdr_vdp_q_jods([(a, b)], viewing.pixels_per_degree)[0], "HDR-VDP-3", notes)
    if jod is not None or q_jod is not None:
        notes.insert(0, f"The judges saw the whole {a.shape[1]}x{a.shape[0]} pictures on {viewing}.")
        clipped = [float((np.max(image, axis=-1) >= viewing.peak_nits).mean()) for image in (a, b)]
        if viewing is HDR_VIEWING and max(clipped) > 0:
            notes.insert(1, f"That display clips {max(clipped):.2%} of the pixels.")
    return Judgement(jod, q_jod, _conditions(a.shape, viewing, nits), tuple(notes))


def _score(compute: Callable[[], float], name: str, notes: list[str]) -> float | None:
    try:
        score = compute()
    except MfoError as error:
        notes.append(str(error))
        return None
    if np.isfinite(score):
        return score
    notes.append(f"{name} has no finite score for this pair.")
    return None


def _conditions(shape: tuple[int, ...], viewing: Viewing, nits: float) -> dict[str, Any]:
    return {
        "width": shape[1],
        "height": shape[0],
        "pixels_per_degree": viewing.pixels_per_degree,
        "peak_nits": viewing.peak_nits,
        "contrast": viewing.contrast,
        "ambient_lux": viewing.ambient_lux,
        "nits_per_unit": nits,
    }
