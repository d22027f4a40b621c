# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of textures between their pixels, as Cycles interpolates them, on a finer grid that Mitsuba can read.

Cycles filters sRGB pictures before it decodes them (kernel/svm/image.h), times their alpha, by which it divides
again where the node's Alpha is linked (scene/shader_nodes.cpp, ImageTextureNode), and has a cubic B-spline. Mitsuba
interpolates linearly what it is given. So the picture is filtered here, between its pixels, as finely as is affordable.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import working_space_to_rec709
from .color_space import linear_to_srgb, srgb_to_linear
from .image_alpha import as_cycles_has_it, blend, is_read_by_cycles, multiplies
from .image_pixels import SRGB_NAMES, UnreadableImageError, is_data, read_encoded, read_pixels

MOST_PIXELS = 1 << 22  # of a finer grid; 2048 squared, 50 MB of colours
FINEST = 8  # points of the finer grid along a pixel: a black and white checker is 0.3 % off, with 4 points 1 %
# Of a colour that is divided by its alpha: a floor whose picture had colours at alpha 0 was 20 to 90 % too dark, by how
# near Cycles' samples came to alpha 0
MOST_DIVIDED, LEAST_COLOUR = 100.0, 1e-3

Pixels = NDArray[np.float32]


def filtered_pixels(
    image: bpy.types.Image, interpolation: str, wrap: str, *, alpha_read: bool, bends: bool = False
) -> Pixels:
    """Return float32 (height, width, 4), first row at the top, linear Rec.709 or raw, perhaps on a finer grid.

    `alpha_read` says whether the texture node's Alpha is linked, and `bends` whether nodes after it are no straight
    lines: these see interpolated numbers.

    Raises
    ------
    UnreadableImageError
        If the image cannot be read.
    """
    encoded = not is_data(image) and image.colorspace_settings.name in SRGB_NAMES
    encoded &= working_space_to_rec709() is None  # else Cycles converts pixels before it filters them
    pixels = read_encoded(image) if encoded and not image.is_float else read_pixels(image)
    pixels, blended = as_cycles_has_it(image, pixels)
    if image.is_float and not is_read_by_cycles(image):
        encoded = False  # Cycles does not decode what Blender has decoded
    if encoded and image.is_float:  # of which Blender keeps linear numbers
        pixels = np.concatenate([linear_to_srgb(pixels[:, :, :3]), pixels[:, :, 3:]], axis=2)
    pixels = blend(image, pixels, are_bytes=encoded and not image.is_float) if blended else pixels
    divided = alpha_read and blended
    steps = _steps(pixels)
    if steps > 1 and interpolation in ("Cubic", "Smart"):
        pixels = _finer(pixels, steps, wrap, _cubic)
    elif steps > 1 and (encoded or divided or bends) and interpolation == "Linear":
        pixels = _finer(pixels, steps, wrap, _linear)
    elif encoded:
        pixels = pixels.copy()
    if divided:
        color, alpha = pixels[:, :, :3], pixels[:, :, 3:]
        pixels = np.concatenate([np.divide(color, alpha, out=color.copy(), where=alpha > 0.0), alpha], axis=2)
    if encoded:
        pixels[:, :, :3] = srgb_to_linear(pixels[:, :, :3])
    return pixels


def equirectangular_pixels(image: bpy.types.Image, interpolation: str) -> Pixels:
    """Return a world's picture as `filtered_pixels` do, (height, width, 3); without interpolation its pixels get edges.

    Raises
    ------
    UnreadableImageError
        If the image cannot be read.
    """
    pixels = filtered_pixels(image, interpolation, "repeat", alpha_read=False)[:, :, :3]
    steps = _steps(pixels) if interpolation == "Closest" else 1
    return np.ascontiguousarray(np.repeat(np.repeat(pixels, steps, axis=0), steps, axis=1))


def divides_by_nothing(image: bpy.types.Image, interpolation: str) -> bool:
    """Whether Cycles, where a node's Alpha is linked, divides colours that are there by an alpha that is almost 0."""
    if interpolation == "Closest" or multiplies(image):  # there is nothing between pixels, or less where alpha is 0
        return False
    try:
        pixels, blended = as_cycles_has_it(image, read_encoded(image))
    except UnreadableImageError:
        return False
    if not blended:
        return False
    color = pixels[:, :, :3].max(axis=2)
    return bool(((color > LEAST_COLOUR) & (color > MOST_DIVIDED * pixels[:, :, 3])).any())


def _steps(pixels: Pixels) -> int:
    """Points of the finer grid along a pixel; 1 for one of a single colour or a size that allows no more."""
    if (pixels == pixels[:1, :1]).all():
        return 1
    return int(np.clip(np.sqrt(MOST_PIXELS / pixels[:, :, 0].size), 1, FINEST))


def _linear(x: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return [1.0 - x, x]


def _cubic(x: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The uniform cubic B-spline."""
    return [
        (1.0 - x) ** 3 / 6.0,
        (3.0 * x**3 - 6.0 * x**2 + 4.0) / 6.0,
        (-3.0 * x**3 + 3.0 * x**2 + 3.0 * x + 1.0) / 6.0,
        x**3 / 6.0,
    ]


def _finer(pixels: Pixels, steps: int, wrap: str, kernel: object) -> Pixels:
    """`steps` points along each pixel, rows first."""
    for axis in (0, 1):
        count = pixels.shape[axis]
        place = (np.arange(count * steps) + 0.5) / steps - 0.5
        first = np.floor(place).astype(int)
        weights = kernel(place - first)  # type: ignore[operator]
        total = np.zeros((*pixels.shape[:axis], count * steps, *pixels.shape[axis + 1 :]), np.float32)
        for k, weight in enumerate(weights):
            index = _wrapped(first + k - (len(weights) // 2 - 1), count, wrap)
            shape = [1, 1, 1]
            shape[axis] = -1
            total += np.take(pixels, index, axis=axis) * weight.astype(np.float32).reshape(shape)
        pixels = total
    return pixels


def _wrapped(index: NDArray[np.int64], count: int, wrap: str) -> NDArray[np.int64]:
    """Pixels by Mitsuba's word for what lies beyond the edge."""
    if wrap == "clamp":
        return np.clip(index, 0, count - 1)
    if wrap == "mirror":
        index = index % (2 * count)
        return np.minimum(index, 2 * count - 1 - index)
    return index % count
