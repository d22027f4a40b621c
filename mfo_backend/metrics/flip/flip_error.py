# SPDX-License-Identifier: Apache-2.0
"""FLIP and HDR-FLIP of two pictures for reporting: map and mean, whatever their encodings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from ...types.image import Encoding, Image
from ..display.tone_mapping import DisplayView, View
from .hdr_flip import hdr_flip_map
from .ldr_flip import flip_map


@dataclass(frozen=True)
class ErrorMap:
    """An error for every pixel, float32 (height, width), and its mean."""

    map: NDArray[np.float32]

    @property
    def mean(self) -> float:
        """The pooled error."""
        return float(self.map.mean(dtype=np.float64))


def flip_error(reference: Image, test: Image, *, display: View | None = None) -> ErrorMap:
    """LDR-FLIP of what a display shows of both pictures, in [0, 1].

    A scene-linear picture is shown through `display`; by default that is Standard without exposure if one picture holds
    display values, else a gamma curve exposed for the reference.
    """
    if display is None:
        both_linear = reference.encoding is Encoding.LINEAR and test.encoding is Encoding.LINEAR
        display = DisplayView.for_scene(reference.pixels) if both_linear else DisplayView()
    return ErrorMap(flip_map(*(shown(image, display) for image in (reference, test))))


def hdr_flip_error(reference: Image, test: Image) -> ErrorMap:
    """HDR-FLIP of two scene-linear pictures in [0, 1], with the official exposure range.

    Raises
    ------
    BadInputError
        If a picture holds display values.
    """
    if reference.encoding is not Encoding.LINEAR or test.encoding is not Encoding.LINEAR:
        raise BadInputError("HDR-FLIP needs two scene-linear pictures (EXR or HDR): use FLIP for display values.")
    return ErrorMap(hdr_flip_map(reference.pixels, test.pixels))


def shown(image: Image, display: View) -> NDArray[np.float32]:
    """sRGB display values of a picture; a scene-linear one is seen through `display`."""
    return display.display(image.pixels) if image.encoding is Encoding.LINEAR else image.pixels
