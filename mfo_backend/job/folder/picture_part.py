# SPDX-License-Identifier: Apache-2.0
"""The part of a reference that a fit looks at: a rectangle, a painted mask, its alpha, Blender's Render Region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.colour import srgb_from_linear
from ...scene.image_file import read_image
from ...types.errors import BadInputError
from ...types.image import Encoding, Image
from .checked_object import CheckedObject
from .job_folder import JobFolder

WHOLE = (0.0, 0.0, 1.0, 1.0)
PAINTED = 0.5  # of white, from which on a pixel of a mask counts
OPAQUE = 0.99  # alpha below which a pixel shows something else, too; 8 bits have 0.996 next to 1
# Beside a Render Region Blender leaves a picture black and transparent, which a view may show as another colour and
# JPEG blurs over its blocks of 16 pixels. Under every view of 4.3 and 5.0, with all of their dither, it is even within
# 2 / 255 as PNG, JPEG, TIFF and WebP.
BLOCK = 16  # pixels
ALIKE = 2.5 / 255  # of the display's range
ODD = 0.01  # share of the pixels that may differ more

COUNTED = "{share} of the reference's pixels count ({why}); the others have no part in the fit and its verdict."
MASK_SCALED = "The mask is {mask} pixels and the reference {picture}: it was scaled to that."
NOTHING_LEFT = "Nothing of the reference is left ({why}): give a part that holds some of the object."
ALL_OF_FRAME = "Render Region is on, and the reference shows more than the region: all of it counts."
HALF_CLEAR = (
    "Half-clear pixels of the reference ({share}) have no part in the fit: a display picture has their colours without "
    "what is behind them."
)
NO_ALPHA = "The reference has no alpha channel, so all of it counts."


@dataclass(frozen=True)
class PicturePart:
    """What of a reference counts; by default all of it.

    Attributes
    ----------
    crop
        Left, top, right and bottom of a rectangle, parts of width and height from the upper left corner on.
    mask
        A picture file of the job: what is white in it counts, what is black or transparent does not.
    alpha
        Whether what is transparent in the reference itself does not count.
    region
        A rectangle like `crop`, Blender's Render Region: it alone counts where the picture is empty beside it.
    """

    crop: tuple[float, float, float, float] = WHOLE
    mask: str = ""
    alpha: bool = False
    region: tuple[float, float, float, float] = WHOLE

    def __post_init__(self) -> None:
        for name, (left, top, right, bottom) in (("crop", self.crop), ("region", self.region)):
            if not (0.0 <= left < right <= 1.0 and 0.0 <= top < bottom <= 1.0):
                edges = ", ".join(f"{100 * edge:g} %" for edge in (left, top, right, bottom))
                raise BadInputError(
                    f"The {name} is {edges}: left must be below right, top below bottom, all from 0 to 100 %."
                )

    @property
    def is_whole(self) -> bool:
        """Whether all of the reference counts."""
        return self == PicturePart()

    @property
    def words(self) -> str:
        """What makes the part, for sentences."""
        made = (
            *(("crop", self.crop != WHOLE), ("mask", bool(self.mask)), ("alpha", self.alpha)),
            ("Render Region", self.region != WHOLE),
        )
        return ", ".join(word for word, used in made if used)


def part_from_json(reference: CheckedObject) -> PicturePart:
    """The part in the object `reference` of request.json, whose keys are `crop`, `mask`, `alpha` and `region`."""
    crop, region = (_rectangle(reference, key) for key in ("crop", "region"))
    return PicturePart(crop, reference.text("mask", ""), reference.boolean("alpha", False), region)


def _rectangle(reference: CheckedObject, key: str) -> tuple[float, float, float, float]:
    given = reference.raw(key, list(WHOLE))
    if not isinstance(given, (list, tuple)) or len(given) != 4:
        raise reference.wrong(key, "a list of left, top, right and bottom, each from 0 to 1")
    edges = CheckedObject(dict(zip("0123", given, strict=True)), f"{reference.where}.{key}", "0123")
    left, top, right, bottom = (edges.number(edge, 0.0, 1.0) for edge in "0123")
    return left, top, right, bottom


def part_to_json(part: PicturePart) -> Mapping[str, Any]:
    """The keys of `reference` that say it; none for the whole picture."""
    said = {"crop": list(part.crop), "mask": part.mask, "alpha": part.alpha, "region": list(part.region)}
    return {key: said[key] for key in said if getattr(part, key) != getattr(PicturePart(), key)}


def with_part(image: Image, part: PicturePart, folder: JobFolder) -> tuple[Image, tuple[str, ...]]:
    """The reference with what of it counts, and notes on that.

    Raises
    ------
    BadInputError
        If the mask cannot be read, or nothing is left.
    """
    half_clear = _half_clear(image)
    if part.is_whole and not half_clear.any():
        return image, ()
    notes: list[str] = []
    counts = _inside(part.crop, image)
    if part.region != WHOLE and _is_empty_beside(part.region, image):
        counts &= _inside(part.region, image)
    elif part.region != WHOLE:
        notes.append(ALL_OF_FRAME)
        part = replace(part, region=WHOLE)
    if part.mask:
        mask = read_image(folder.file(part.mask, what="request.json: reference.mask"))
        if (mask.width, mask.height) != (image.width, image.height):
            sizes = (f"{each.width}x{each.height}" for each in (mask, image))
            notes.append(MASK_SCALED.format(**dict(zip(("mask", "picture"), sizes, strict=True))))
        counts &= _scaled(_painted(mask), image)
    if part.alpha and image.alpha is not None:
        counts &= image.alpha >= OPAQUE
    elif part.alpha:
        notes.append(NO_ALPHA)
    if not counts.any():
        raise BadInputError(NOTHING_LEFT.format(why=part.words))
    if not counts.all():
        notes.append(COUNTED.format(share=_per_cent(counts), why=part.words))
    if (lost := counts & half_clear).any() and (counts & ~half_clear).any():
        notes.append(HALF_CLEAR.format(share=_per_cent(lost)))
        counts &= ~half_clear
    if counts.all():
        return image, tuple(notes)
    return replace(image, counts=counts), tuple(notes)


def _per_cent(pixels: NDArray[np.bool_]) -> str:
    return f"{100.0 * pixels.mean():.3g} %"


def _half_clear(image: Image) -> NDArray[np.bool_]:
    """Where a display picture, whose colours are not multiplied by alpha, shows two things; an EXR's are."""
    if image.alpha is None or image.encoding is Encoding.LINEAR:
        return np.zeros((image.height, image.width), bool)
    return (image.alpha > 0.0) & (image.alpha < OPAQUE)


def _inside(crop: tuple[float, float, float, float], image: Image) -> NDArray[np.bool_]:
    """Pixels whose centre is in the rectangle."""
    left, top, right, bottom = crop
    across, down = ((np.arange(count) + 0.5) / count for count in (image.width, image.height))
    return ((down >= top) & (down <= bottom))[:, None] & ((across >= left) & (across <= right))[None, :]


def _is_empty_beside(region: tuple[float, float, float, float], image: Image) -> bool:
    """Whether what lies beside a rectangle is transparent or of one colour, but for the blocks of a JPEG next to it."""
    beside = ~_inside(region, image)
    if image.alpha is not None and not image.alpha[beside].any():
        return True
    left, top, right, bottom = region
    across, down = BLOCK / image.width, BLOCK / image.height
    far = ~_inside((left - across, top - down, right + across, bottom + down), image)
    shown = image.pixels[far if far.any() else beside]
    if image.encoding is Encoding.LINEAR:
        shown = srgb_from_linear(shown)
    odd = (np.abs(shown - np.median(shown, axis=0)) > ALIKE).any(axis=-1)
    return bool(odd.mean() <= ODD)


def _painted(mask: Image) -> NDArray[np.bool_]:
    shown = mask.pixels.mean(axis=-1)
    return (shown if mask.alpha is None else shown * mask.alpha) >= PAINTED


def _scaled(mask: NDArray[np.bool_], image: Image) -> NDArray[np.bool_]:
    """The mask's pixel at the centre of each one of the picture."""
    rows, columns = (
        ((np.arange(count) + 0.5) * own / count).astype(int)
        for count, own in zip((image.height, image.width), mask.shape, strict=True)
    )
    return mask[np.ix_(rows, columns)]
