# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a job as image datablocks: each one, a strip of all, and reference and result split at a line."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from .view_paint import Display

NAMES = ("reference", "result", "difference")
COMPARISON = "Material Fit comparison"
SPLIT = "Material Fit split"
PICTURE_GAP = 8  # pixels between two pictures

_halves: tuple[Display, Display] | None = None


def comparison_image(pictures: Path) -> bpy.types.Image:
    """Load the pictures of a job folder and put them side by side into one packed image.

    Raises
    ------
    OSError
        If a picture is missing or unreadable.
    """
    parts = [_pixels(picture_image(pictures, name)) for name in NAMES]
    height = max(p.shape[0] for p in parts)
    width = sum(p.shape[1] for p in parts) + PICTURE_GAP * (len(parts) - 1)
    strip = np.zeros((height, width, 4), np.float32)
    left = 0
    for part in parts:
        strip[: part.shape[0], left : left + part.shape[1]] = part
        left += part.shape[1] + PICTURE_GAP
    return _packed(COMPARISON, strip)


def split_image(pictures: Path, share: float) -> bpy.types.Image:
    """One packed image, the reference in its left `share` and the result in the rest; `move_split` moves the line.

    Raises
    ------
    OSError
        If a picture is missing, unreadable, or of another size than the other.
    """
    global _halves
    left, right = (_pixels(picture_image(pictures, name)) for name in ("reference", "result"))
    if left.shape != right.shape:
        raise OSError(f"{pictures} holds pictures of different sizes")
    _halves = left, right
    return _packed(SPLIT, _joined(left, right, share))


def move_split(share: float) -> None:
    """Move the line of the split image that was made last; nothing if there is none."""
    image = bpy.data.images.get(SPLIT)
    if image is None or _halves is None or tuple(image.size) != _halves[0].shape[1::-1]:
        return
    image.pixels.foreach_set(_joined(*_halves, share).ravel())
    image.update()


def has_split() -> bool:
    """Whether there is a line that can be moved."""
    return _halves is not None and SPLIT in bpy.data.images


def forget() -> None:
    """Free the pixels kept for `move_split`."""
    global _halves
    _halves = None


def picture_image(pictures: Path, name: str) -> bpy.types.Image:
    """One picture of a job folder, always the same image for the same name.

    Raises
    ------
    OSError
        If it is missing or unreadable.
    """
    path, label = pictures / f"{name}.png", f"Material Fit {name}"
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist")
    image = bpy.data.images.get(label)
    if image is None:
        try:
            image = bpy.data.images.load(str(path))
        except RuntimeError as error:
            raise OSError(str(error).strip()) from error
        image.name = label
    else:
        image.filepath = str(path)
        image.reload()
    if not image.size[0]:
        raise OSError(f"{path} is not a picture")
    return image


def _joined(left: Display, right: Display, share: float) -> Display:
    width = left.shape[1]
    column = round(share * width)
    joined = np.concatenate([left[:, :column], right[:, column:]], axis=1)
    if 0 < column < width:
        joined[:, column] = 1.0
    return joined


def _packed(name: str, pixels: Display) -> bpy.types.Image:
    height, width = pixels.shape[:2]
    image = bpy.data.images.get(name)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(name, width, height, alpha=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()  # a generated image loses its pixels when the file is saved
    return image


def _pixels(image: bpy.types.Image) -> Display:
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)
