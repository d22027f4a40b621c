# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a job as image datablocks: each one, and a strip of reference | result | difference."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

NAMES = ("reference", "result", "difference")
COMPARISON = "Material Fit comparison"
GAP = 8  # pixels between two pictures


def comparison_image(pictures: Path) -> bpy.types.Image:
    """Load the pictures of a job folder and put them side by side into one packed image.

    Raises
    ------
    OSError
        If a picture is missing or unreadable.
    """
    parts = [_pixels(_load(pictures / f"{name}.png", f"Material Fit {name}")) for name in NAMES]
    height = max(p.shape[0] for p in parts)
    width = sum(p.shape[1] for p in parts) + GAP * (len(parts) - 1)
    strip = np.zeros((height, width, 4), np.float32)
    left = 0
    for part in parts:
        strip[: part.shape[0], left : left + part.shape[1]] = part
        left += part.shape[1] + GAP
    image = bpy.data.images.get(COMPARISON)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.new(COMPARISON, width, height, alpha=True)
    image.pixels.foreach_set(strip.ravel())
    image.update()
    image.pack()  # a generated image loses its pixels when the file is saved
    return image


def _load(path: Path, name: str) -> bpy.types.Image:
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist")
    image = bpy.data.images.get(name)
    if image is None:
        try:
            image = bpy.data.images.load(str(path))
        except RuntimeError as error:
            raise OSError(str(error).strip()) from error
        image.name = name
    else:
        image.filepath = str(path)
        image.reload()
    if not image.size[0]:
        raise OSError(f"{path} is not a picture")
    return image


def _pixels(image: bpy.types.Image) -> NDArray[np.float32]:
    """Display values, float32 (height, width, 4), bottom row first as Blender keeps them."""
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)
