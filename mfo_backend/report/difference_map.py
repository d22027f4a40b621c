# SPDX-License-Identifier: Apache-2.0
"""A map of errors as a picture: colours from black to pale yellow, with a bar that says what they mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..metrics.flip.ldr_flip import flip_map
from ..types.image import Pixels

# Every sixteenth colour of matplotlib's magma (S. van der Walt and N. Smith, CC0), the palette of FLIP; between them
# linear, at most 3 of 255 levels off
_MAGMA = np.array(
    [
        [0, 0, 4], [10, 8, 34], [29, 17, 70], [54, 16, 106], [80, 18, 124], [105, 28, 129], [130, 38, 129],
        [156, 46, 127], [182, 55, 121], [207, 65, 112], [230, 81, 99], [245, 105, 92], [251, 135, 97],
        [254, 165, 113], [254, 195, 135], [253, 224, 162], [252, 253, 191],
    ]
)  # fmt: skip
NOT_COUNTED = 0.35  # grey of pixels that have no part in a comparison: no colour of the palette
_SMALLEST_SIDE = 256  # smaller maps are enlarged by whole numbers, so that the text beside them can be read
_BAR_WIDTH, _GAP, _LABEL_WIDTH, _TITLE_HEIGHT = 14, 8, 52, 20
_TICKS = 5


def magma(values: NDArray[np.floating]) -> Pixels:
    """sRGB display values (..., 3) of `values` in [0, 1]; those outside are clipped, NaN is black."""
    nodes = np.linspace(0, 1, len(_MAGMA))
    clipped = np.clip(np.nan_to_num(values), 0, 1)
    return np.stack([np.interp(clipped, nodes, _MAGMA[:, c] / 255) for c in range(3)], axis=-1).astype(np.float32)


def magma_counted(values: NDArray[np.floating], counts: NDArray[np.bool_] | None) -> Pixels:
    """`magma` of a map (height, width), with the grey `NOT_COUNTED` where `counts` is False; None counts everywhere."""
    colours = magma(values)
    return colours if counts is None else np.where(counts[..., None], colours, np.float32(NOT_COUNTED))


def draw_map(values: NDArray[np.floating], *, maximum: float, title: str) -> Pixels:
    """Display values (height, width, 3) of a picture of the map `values` (height, width) with title and colour bar.

    The bar runs from 0 to `maximum`; larger values take its last colour.
    """
    from PIL import Image as PillowImage
    from PIL import ImageDraw, ImageFont

    maximum = maximum if maximum > 0 else 1.0
    scale = max(1, -(-_SMALLEST_SIDE // min(values.shape)) if max(values.shape) < 4 * _SMALLEST_SIDE else 1)
    colours = _levels(magma(values / maximum)).repeat(scale, axis=0).repeat(scale, axis=1)
    height, width = colours.shape[:2]
    bar = np.linspace(1, 0, height)[:, None].repeat(_BAR_WIDTH, axis=1)

    canvas = PillowImage.new("RGB", (width + _GAP + _BAR_WIDTH + _LABEL_WIDTH, height + _TITLE_HEIGHT))
    canvas.paste(PillowImage.fromarray(colours), (0, _TITLE_HEIGHT))
    canvas.paste(PillowImage.fromarray(_levels(magma(bar))), (width + _GAP, _TITLE_HEIGHT))
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default()
    draw.text((4, 4), title, fill="white", font=font)
    for tick in range(_TICKS):
        share = tick / (_TICKS - 1)
        y = _TITLE_HEIGHT + round((1 - share) * (height - 12))
        draw.text((width + _GAP + _BAR_WIDTH + 4, y), f"{share * maximum:.3g}", fill="white", font=font)
    return np.asarray(canvas, np.float32) / np.float32(255)


def difference_picture(reference: Pixels, test: Pixels) -> Pixels:
    """The FLIP map of two pictures in sRGB display values, drawn with its mean and a colour bar from 0 to 1."""
    error = flip_map(reference, test)
    return draw_map(error, maximum=1.0, title=f"FLIP  mean {error.mean(dtype=np.float64):.4f}")


def _levels(display: Pixels) -> NDArray[np.uint8]:
    return np.rint(display * 255).astype(np.uint8)
