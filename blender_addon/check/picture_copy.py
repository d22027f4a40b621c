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


def covering(pixels: Pixels, size: tuple[int, int]) -> Pixels:
    """Scale a picture (height, width, channels) of linear colours until it covers `size` (width, height), and cut it.

    A pixel is the mean of what it covers; where the picture is smaller, neighbours are interpolated.
    """
    old = pixels.shape[1], pixels.shape[0]
    scale = max(size[0] / old[0], size[1] / old[1])
    for axis, count, length in ((1, size[0], old[0]), (0, size[1], old[1])):
        pixels = _resampled(pixels, axis, count, (length - count / scale) / 2.0, 1.0 / scale)
    return np.ascontiguousarray(pixels, dtype=np.float32)


def _resampled(pixels: Pixels, axis: int, count: int, first: float, step: float) -> Pixels:
    """`count` pixels along an axis, each `step` old ones long, from the place `first` on."""
    edges = first + step * np.arange(count + 1)
    moved = np.moveaxis(pixels.astype(np.float64), axis, 0)
    last = len(moved) - 1
    if step <= 1.0:
        place = np.clip((edges[:-1] + edges[1:]) / 2.0 - 0.5, 0.0, last)
        low = place.astype(int)
        weight = (place - low).reshape(-1, *[1] * (moved.ndim - 1))
        found = moved[low] * (1.0 - weight) + moved[np.minimum(low + 1, last)] * weight
    else:
        sums = np.concatenate([np.zeros_like(moved[:1]), np.cumsum(moved, axis=0)])
        edges = np.clip(edges, 0.0, len(moved))
        low = np.minimum(edges.astype(int), last)
        weight = (edges - low).reshape(-1, *[1] * (moved.ndim - 1))
        found = np.diff(sums[low] + weight * moved[low], axis=0) / step
    return np.moveaxis(found, 0, axis).astype(np.float32)


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
