# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a reference that a fit looks at: a rectangle, a painted mask, the reference's own alpha channel."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..files.png_file import write_png
from ..findings import ExportError
from ..images.image_pixels import UnreadableImageError, read_encoded

WHOLE = (0.0, 0.0, 1.0, 1.0)
PAINTED = 0.5  # of white, as the backend's `job.folder.picture_part`


@dataclass(frozen=True)
class CountedPart:
    """A picture of which not all counts.

    Attributes
    ----------
    picture
        A file, or an image of the .blend.
    crop
        Left, top, right and bottom of a rectangle, parts of width and height from the upper left corner on.
    mask
        A file or an image: what is white in it counts, what is black or transparent does not.
    alpha
        Whether what is transparent in the picture itself does not count.
    """

    picture: Path | bpy.types.Image
    crop: tuple[float, float, float, float] = WHOLE
    mask: Path | bpy.types.Image | None = None
    alpha: bool = False

    @property
    def name(self) -> str:
        """The picture's name."""
        return self.picture.name

    def check(self, *, thorough: bool = True) -> None:
        """Raise `ExportError` for a crop that leaves nothing or a mask that cannot be read, or `thorough` is black."""
        left, top, right, bottom = self.crop
        if not (0.0 <= left < right <= 1.0 and 0.0 <= top < bottom <= 1.0):
            raise ExportError("The crop leaves nothing: left must be below right, and top below bottom.")
        mask = self.mask
        if isinstance(mask, Path):
            if not mask.is_file():
                raise ExportError(f"The mask {mask} does not exist: choose another file.")
        elif mask is not None and thorough and not (_painted(mask) >= PAINTED).any():
            raise ExportError(f"The mask '{mask.name}' is black everywhere: paint white what counts.")

    def write(self, folder: Path) -> dict[str, Any]:
        """Write the mask into `folder`; returns what request.json says of the part.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        said: dict[str, Any] = {"crop": list(self.crop)} if self.crop != WHOLE else {}
        if self.alpha:
            said["alpha"] = True
        if isinstance(self.mask, bpy.types.Image):
            levels = np.rint(_painted(self.mask).clip(0.0, 1.0) * 255.0).astype(np.uint8)
            write_png(folder / "mask.png", np.repeat(levels[:, :, None], 3, axis=-1))
            said["mask"] = "mask.png"
        elif self.mask is not None:
            said["mask"] = f"mask{self.mask.suffix.lower()}"
            shutil.copyfile(self.mask, folder / said["mask"])
        return said


def picture_of(reference: Path | bpy.types.Image | CountedPart) -> Path | bpy.types.Image:
    """The picture itself, whatever of it counts."""
    return reference.picture if isinstance(reference, CountedPart) else reference


def _painted(mask: bpy.types.Image) -> NDArray[np.float32]:
    """How white the pixels of a mask are, 0 where they are transparent; (height, width)."""
    try:
        pixels = read_encoded(mask)
    except UnreadableImageError as problem:
        raise ExportError(f"The mask '{mask.name}' {problem}.") from None
    return pixels[:, :, :3].mean(axis=-1) * pixels[:, :, 3]
