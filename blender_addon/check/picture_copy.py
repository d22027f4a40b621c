# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of the reference that suit the scene, turned upright or scaled to the frame; the picture itself stays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..backend.preferences import new_job_folder
from ..export.files.exr_file import REC709, write_exr
from ..export.files.png_file import write_png
from ..export.images.covering import covering
from ..export.images.image_pixels import UnreadableImageError, read_pixels
from ..export.images.picture_header import PictureHeader, read_header
from ..export.reference.reference import holds_display_colours
from ..export.reference.turned_picture import turned

Pixels = NDArray[np.float32]


class PictureCopyError(Exception):
    """No copy can be made; the message is one sentence for the user."""


def turn_upright(context: bpy.types.Context) -> None:
    """Make a copy the reference that is turned as the picture's EXIF data say."""
    with _reference(context) as (image, header):
        pixels = read_pixels(image)[:, :, :3]
        _use(context, image, header, turned(pixels, header.orientation if header is not None else 1), "upright")


def scale_to_frame(context: bpy.types.Context, size: tuple[int, int]) -> None:
    """Make a copy the reference that covers a frame of `size` (width, height); what is over is cut off evenly."""
    with _reference(context) as (image, header):
        pixels = read_pixels(image)[:, :, :3]
        is_display = _is_display(image, header)
        encoded = is_display and header is not None  # a file's numbers as they are; an image's are linear already
        linear = _decoded(pixels) if encoded else pixels
        scaled = covering(linear, size)
        _use(context, image, header, _encoded(scaled) if encoded else scaled, f"{size[0]}x{size[1]}")


@contextmanager
def _reference(context: bpy.types.Context) -> Iterator[tuple[bpy.types.Image, PictureHeader | None]]:
    """The reference's image and, of a file, its header; a file comes with its numbers as they are."""
    settings = context.scene.mfo
    if settings.reference_source == "IMAGE":
        try:
            yield settings.reference_image, None
        except (OSError, UnreadableImageError) as error:
            raise PictureCopyError(f"A copy of '{settings.reference_image.name}' cannot be made ({error}).") from error
        return
    path = Path(bpy.path.abspath(settings.reference_path))
    try:
        header = read_header(path)
        image = bpy.data.images.load(str(path), check_existing=False)
    except (OSError, RuntimeError) as error:
        raise PictureCopyError(f"The reference {path.name} cannot be read ({error}): choose another file.") from error
    try:
        image.colorspace_settings.name = "Non-Color"
        yield image, header
    except (OSError, UnreadableImageError) as error:
        raise PictureCopyError(f"A copy of {path.name} cannot be made ({error}).") from error
    finally:
        bpy.data.images.remove(image)


def _is_display(image: bpy.types.Image, header: PictureHeader | None) -> bool:
    return holds_display_colours(image) if header is None else header.kind not in ("OpenEXR", "Radiance HDR")


def _use(
    context: bpy.types.Context, image: bpy.types.Image, header: PictureHeader | None, pixels: Pixels, word: str
) -> None:
    """Write the copy into a folder of its own and make it the reference."""
    settings = context.scene.mfo
    folder = new_job_folder(context, "reference")
    folder.mkdir(parents=True, exist_ok=True)
    stem = Path(settings.reference_path).stem if header is not None else image.name
    stem = "".join(letter if letter.isalnum() or letter in " -_" else "_" for letter in stem)
    if _is_display(image, header):
        copy = folder / f"{stem} {word}.png"
        shown = pixels if header is not None else _encoded(pixels)
        write_png(copy, np.rint(shown.clip(0.0, 1.0) * 255.0).astype(np.uint8))
    else:
        copy = folder / f"{stem} {word}.exr"
        said = (header.space, header.primaries or REC709) if header is not None else ("", REC709)
        write_exr(copy, np.ascontiguousarray(pixels, dtype=np.float32), space=said[0], primaries=said[1])
    settings.reference_source, settings.reference_path = "FILE", str(copy)


def _decoded(display: Pixels) -> Pixels:
    """IEC 61966-2-1."""
    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _encoded(linear: Pixels) -> Pixels:
    """IEC 61966-2-1."""
    bright = 1.055 * np.maximum(linear, 1e-9) ** (1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, bright).astype(np.float32)
