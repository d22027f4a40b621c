# SPDX-License-Identifier: Apache-2.0
"""The part of a reference that a fit looks at: a rectangle, a painted mask, the reference's own alpha channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.image_file import read_image
from ...types.errors import BadInputError
from ...types.image import Image
from .checked_object import CheckedObject
from .job_folder import JobFolder

WHOLE = (0.0, 0.0, 1.0, 1.0)
PAINTED = 0.5  # of white, from which on a pixel of a mask counts
OPAQUE = 0.99  # alpha below which a pixel shows something else, too; 8 bits have 0.996 next to 1

COUNTED = "{share} of the reference's pixels count ({why}); the others have no part in the fit and its verdict."
MASK_SCALED = "The mask is {mask} pixels and the reference {picture}: it was scaled to that."
NOTHING_LEFT = "Nothing of the reference is left ({why}): give a part that holds some of the object."
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
    """

    crop: tuple[float, float, float, float] = WHOLE
    mask: str = ""
    alpha: bool = False

    def __post_init__(self) -> None:
        left, top, right, bottom = self.crop
        if not (0.0 <= left < right <= 1.0 and 0.0 <= top < bottom <= 1.0):
            raise BadInputError(
                f"The crop is {', '.join(f'{100 * edge:g} %' for edge in self.crop)}: left must be below right, top "
                "below bottom, all from 0 to 100 %."
            )

    @property
    def is_whole(self) -> bool:
        """Whether all of the reference counts."""
        return self == PicturePart()

    @property
    def words(self) -> str:
        """What makes the part, for sentences."""
        made = (("crop", self.crop != WHOLE), ("mask", bool(self.mask)), ("alpha", self.alpha))
        return ", ".join(word for word, used in made if used)


def part_from_json(reference: CheckedObject) -> PicturePart:
    """The part in the object `reference` of request.json, whose keys are `crop`, `mask` and `alpha`."""
    crop = reference.raw("crop", list(WHOLE))
    if not isinstance(crop, (list, tuple)) or len(crop) != 4:
        raise reference.wrong("crop", "a list of left, top, right and bottom, each from 0 to 1")
    edges = CheckedObject(dict(zip("0123", crop, strict=True)), f"{reference.where}.crop", "0123")
    left, top, right, bottom = (edges.number(key, 0.0, 1.0) for key in "0123")
    return PicturePart((left, top, right, bottom), reference.text("mask", ""), reference.boolean("alpha", False))


def part_to_json(part: PicturePart) -> Mapping[str, Any]:
    """The keys of `reference` that say it; none for the whole picture."""
    said = {"crop": list(part.crop), "mask": part.mask, "alpha": part.alpha}
    return {key: said[key] for key in said if getattr(part, key) != getattr(PicturePart(), key)}


def with_part(image: Image, part: PicturePart, folder: JobFolder) -> tuple[Image, tuple[str, ...]]:
    """The reference with what of it counts, and notes on that.

    Raises
    ------
    BadInputError
        If the mask cannot be read, or nothing is left.
    """
    if part.is_whole:
        return image, ()
    notes: list[str] = []
    counts = _inside(part.crop, image)
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
    if counts.all():
        return image, tuple(notes)
    notes.append(COUNTED.format(share=f"{100.0 * counts.mean():.3g} %", why=part.words))
    return replace(image, counts=counts), tuple(notes)


def _inside(crop: tuple[float, float, float, float], image: Image) -> NDArray[np.bool_]:
    """Pixels whose centre is in the rectangle."""
    left, top, right, bottom = crop
    across, down = ((np.arange(count) + 0.5) / count for count in (image.width, image.height))
    return ((down >= top) & (down <= bottom))[:, None] & ((across >= left) & (across <= right))[None, :]


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
