# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of Blender images as linear Rec.709, without changing the image."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .color_space import srgb_to_linear, to_rec709

LINEAR_NAMES = ("Linear Rec.709", "Linear", "scene_linear")
SRGB_NAMES = ("sRGB",)
MAGENTA = (1.0, 0.0, 1.0)  # Cycles' IMAGE_MISSING_RGBA, in its working space; alpha is 1


_only_looking = False


class UnreadableImageError(Exception):
    """The pixels cannot be had; the message is the end of a sentence that starts with the image's name."""


@contextmanager
def without_pixels() -> Iterator[None]:
    """Within it `read_pixels` refuses what it always refuses and gives one grey pixel for the rest, at once."""
    global _only_looking
    before, _only_looking = _only_looking, True
    try:
        yield
    finally:
        _only_looking = before


def is_missing(image: bpy.types.Image | None) -> bool:
    """Whether Cycles has no pixels for a picture, and shows `MAGENTA` at any coordinate that is not clipped."""
    if image is None:
        return True
    if image.source == "TILED":  # has no size before it is rendered
        return False
    if image.source in ("SEQUENCE", "MOVIE"):  # has pixels at the frames that were shown
        return not image.packed_files and not Path(bpy.path.abspath(image.filepath, library=image.library)).exists()
    return not image.has_data and not image.packed_file and not any(image.size)


def is_data(image: bpy.types.Image) -> bool:
    """Whether the numbers of `image` are no colours (Non-Color, Raw)."""
    return image.colorspace_settings.is_data or image.colorspace_settings.name in ("Non-Color", "Raw")


def read_pixels(image: bpy.types.Image) -> NDArray[np.float32]:
    """Return float32 (height, width, 4), first row at the top: linear Rec.709, or the raw numbers of a data image.

    Raises
    ------
    UnreadableImageError
        If the file is missing, the image is a movie or tiled, or its colour space is not one we decode.
    """
    pixels = read_encoded(image)
    if is_data(image) or _only_looking:
        return pixels
    if image.is_float:  # Blender converts float files to its working space when it loads them
        pixels[:, :, :3] = to_rec709(pixels[:, :, :3])
    elif image.colorspace_settings.name in SRGB_NAMES:
        pixels[:, :, :3] = srgb_to_linear(pixels[:, :, :3])
    return pixels


def read_encoded(image: bpy.types.Image) -> NDArray[np.float32]:
    """Return what `read_pixels` does as Blender keeps it: bytes in the image's own colour space.

    Raises
    ------
    UnreadableImageError
        As `read_pixels`.
    """
    if image.source in ("MOVIE", "SEQUENCE", "TILED"):
        raise UnreadableImageError(f"is a {image.source.lower()}; only single pictures are supported")
    if image.type == "MULTILAYER":
        raise UnreadableImageError("is an EXR file of several layers; only single pictures are supported")
    width, height = image.size
    if width == 0 or height == 0 or (not image.has_data and not len(image.pixels)):
        raise UnreadableImageError("has no pixels (is its file missing? use File > External Data > Find Missing Files)")
    _refuse_colour_space(image)
    if _only_looking:
        return np.full((1, 1, 4), 0.5, dtype=np.float32)
    channels = image.channels
    raw = _raw(image).reshape(height, width, channels)[::-1]
    pixels = np.ones((height, width, 4), dtype=np.float32)
    if channels < 3:
        pixels[:, :, :3] = raw[:, :, :1]
    else:
        pixels[:, :, :channels] = raw
    return pixels


def are_usual(image: bpy.types.Image, largest: float) -> bool:
    """Whether no number of an image is NaN or beyond `largest` either way; one whose pixels cannot be had passes."""
    if not image.is_float or not (image.has_data or len(image.pixels)):
        return True
    raw = _raw(image)
    with np.errstate(invalid="ignore"):
        return not raw.size or bool(raw.min() >= -largest and raw.max() <= largest)


def _raw(image: bpy.types.Image) -> NDArray[np.float32]:
    raw = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
    image.pixels.foreach_get(raw)
    return raw


def _refuse_colour_space(image: bpy.types.Image) -> None:
    space = image.colorspace_settings.name
    if not (is_data(image) or image.is_float or space in SRGB_NAMES or space in LINEAR_NAMES):
        raise UnreadableImageError(f"has the colour space {space}; set it to sRGB, Linear Rec.709 or Non-Color")
