# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures whose EXIF data want them shown turned, as phones write them; Blender shows and renders them as stored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..findings import ExportError, Fix
from ..images.picture_header import PictureHeader

SIDEWAYS = (5, 6, 7, 8)
# orientation of EXIF 2.3, 4.6.4, in words
_SHOWN = {
    2: "mirrored",
    3: "turned by 180 degrees",
    4: "mirrored and turned by 180 degrees",
    5: "mirrored and turned by 90 degrees to the left",
    6: "turned by 90 degrees to the right",
    7: "mirrored and turned by 90 degrees to the right",
    8: "turned by 90 degrees to the left",
}


def turned(pixels: NDArray[np.float32], orientation: int) -> NDArray[np.float32]:
    """The picture (height, width, channels) as EXIF data of this orientation want it shown."""
    if orientation in SIDEWAYS:
        pixels = np.swapaxes(pixels, 0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def turn_notes(name: str, header: PictureHeader, wanted: tuple[int, int], copy: str = "") -> tuple[str, ...]:
    """What a user should know of a picture that is taken as it is stored, for a render of `wanted` (width, height).

    `copy` is what the job calls it.

    Raises
    ------
    ExportError
        If only the turned picture has the size of the render.
    """
    shown = _SHOWN.get(header.orientation)
    if shown is None:
        return ()
    stored = (header.width, header.height)
    if header.orientation in SIDEWAYS and stored != wanted and stored[::-1] == wanted:
        raise ExportError(
            f"The reference {name} is stored as {stored[0]}x{stored[1]} and its EXIF data want it shown {shown}, which "
            f"is the {wanted[0]}x{wanted[1]} of this scene: take a turned copy (Turn Upright, --upright).",
            Fix("upright"),
        )
    return (  # the first in the backend's words, which finds it too and says it once
        f"{copy or name}: its EXIF data want it shown {shown}; it was taken as it is stored, as in Blender.",
        "If the scene was matched to the turned picture, take a turned copy (Turn Upright, --upright).",
    )
