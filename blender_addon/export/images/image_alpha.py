# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of pictures with alpha: which numbers Cycles has of them, and whether it multiplies these by alpha.

Cycles reads files by OpenImageIO and asks Blender for the pixels of others. Up to Blender 5.1 a file's own word
decides whether its colours are multiplied already, and the image's Alpha in Blender changes nothing; from 5.2 on Alpha
decides: Straight is multiplied, Premultiplied is not (ImageMetaData::finalize in util/image_metadata.cpp).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import alpha_is_by_setting, reads_webp_multiplied, working_space_to_rec709
from .image_pixels import SRGB_NAMES, is_data, read_encoded, read_pixels
from .picture_header import PictureHeader, read_header

MULTIPLIED_FILES = ("OpenEXR", "Radiance HDR", "TIFF", "WebP")  # by what OpenImageIO says of them
LARGEST_BYTE = 255.0
DEPTHS_WITH_ALPHA = (32, 64, 128)  # bits of a pixel

Pixels = NDArray[np.float32]


def as_cycles_has_it(image: bpy.types.Image, pixels: Pixels) -> tuple[Pixels, bool]:
    """The colours of an image before Cycles thinks of alpha, and whether alpha changes them.

    `pixels` are Blender's (height, width, 4), encoded or not as those that come back. Without a change alpha is 1 or
    beside the colours.
    """
    mode, is_read = image.alpha_mode, is_read_by_cycles(image)
    if is_read and reads_webp_multiplied() and _kind(image) == "WebP":
        stored = _times_alpha(_as_stored(image), np.rint)
        pixels = stored if mode != "NONE" else np.concatenate([stored[:, :, :3], pixels[:, :, 3:]], axis=2)
    elif is_read and _has_alpha(pixels) and (mode == "PREMUL" or (mode == "STRAIGHT" and image.is_float)):
        # Blender divides bytes where Alpha says that they are multiplied, and multiplies floats by Straight
        pixels = np.concatenate([_as_stored(image)[:, :, :3], pixels[:, :, 3:]], axis=2)
    if mode == "NONE":
        return np.concatenate([pixels[:, :, :3], np.ones_like(pixels[:, :, 3:])], axis=2), False
    return pixels, _has_alpha(pixels) and mode != "CHANNEL_PACKED" and not is_data(image)


def blend(image: bpy.types.Image, pixels: Pixels, *, are_bytes: bool) -> Pixels:
    """The colours that Cycles interpolates, of those that it has: times alpha where it multiplies.

    `are_bytes` says that the pixels are those of a file of bytes, as they are there.
    """
    if not multiplies(image):
        return pixels
    return _times_alpha(pixels, _floor if are_bytes else None)


def multiplies(image: bpy.types.Image) -> bool:
    """Whether Cycles multiplies an image's colours by alpha."""
    if alpha_is_by_setting():
        return image.alpha_mode == "STRAIGHT"
    if not is_read_by_cycles(image):
        return not image.is_float
    header = _header(image)
    return header is None or header.has_straight_alpha or header.kind not in MULTIPLIED_FILES


def is_read_by_cycles(image: bpy.types.Image) -> bool:
    """Whether Cycles reads the file of an image itself, and does not ask Blender for pixels."""
    return image.source == "FILE" and image.packed_file is None


def reads_alpha_otherwise(image: bpy.types.Image) -> bool:
    """Whether Open Shading Language, which reads files by itself, may have other colours of an image.

    It multiplies them by alpha whatever the image's Alpha says, and may divide them again after the filter. A floor by
    a PNG of random alpha was 31 % darker under *None*, by an EXR whose alpha is the roughness 6 % brighter.
    """
    return is_read_by_cycles(image) and image.depth in DEPTHS_WITH_ALPHA


def _has_alpha(pixels: Pixels) -> bool:
    return bool((pixels[:, :, 3] != 1.0).any())


def _times_alpha(pixels: Pixels, whole: Callable[[Pixels], Pixels] | None) -> Pixels:
    """Colours times alpha, of bytes by how they become whole ones."""
    color = pixels[:, :, :3] * pixels[:, :, 3:]
    if whole is not None:
        color = whole(color * LARGEST_BYTE) / np.float32(LARGEST_BYTE)
    return np.concatenate([color, pixels[:, :, 3:]], axis=2)


def _floor(numbers: Pixels) -> Pixels:
    return np.floor(numbers + 1e-3)  # floats are a little below whole numbers at times


def _as_stored(image: bpy.types.Image) -> Pixels:
    """Pixels of a file as it holds them, whatever the image's Alpha makes of them in Blender."""
    copy = image.copy()
    try:
        copy.alpha_mode = "CHANNEL_PACKED"
        encoded = not image.is_float and image.colorspace_settings.name in SRGB_NAMES
        encoded &= working_space_to_rec709() is None
        return (read_encoded if encoded else read_pixels)(copy)
    finally:
        bpy.data.images.remove(copy)


def _kind(image: bpy.types.Image) -> str:
    header = _header(image)
    return "" if header is None else header.kind


def _header(image: bpy.types.Image) -> PictureHeader | None:
    """What an image's file says of itself; None where it cannot be told."""
    try:
        return read_header(Path(bpy.path.abspath(image.filepath, library=image.library)))
    except OSError:
        return None
