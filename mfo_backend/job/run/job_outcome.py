# SPDX-License-Identifier: Apache-2.0
"""What the fit of a job hands over: its result, and the pictures that belong to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...render.sheet.contact_sheet import ContactSheet
from ...types.image import Pixels
from ...types.result import FitResult


@dataclass(frozen=True)
class SeenPicture:
    """What a fit has made of one picture: scene-linear at start and end, and which pixels count."""

    start: Pixels
    result: Pixels
    counted: NDArray[np.bool_]


@dataclass(frozen=True)
class JobOutcome:
    """The result of a fit, its pictures at start and end (scene-linear) and the Mitsuba variant that made them.

    Errors are those of the `counted` pixels, True (height, width). With a `sheet` all of them are over that. Of several
    `materials` each has an outcome of its own, and this one says what holds of all. `only` are the pictures that show a
    material, where not all of a sheet do.
    """

    result: FitResult
    start_image: Pixels
    result_image: Pixels
    counted: NDArray[np.bool_]
    variant: str = ""
    sheet: ContactSheet | None = None
    materials: tuple[JobOutcome, ...] = ()
    only: tuple[SeenPicture, ...] = ()

    @property
    def seen(self) -> tuple[SeenPicture, ...]:
        """What the fit has made of each of its pictures."""
        if self.only:
            return self.only
        sheet = self.sheet
        if sheet is None:
            return (SeenPicture(self.start_image, self.result_image, self.counted),)
        return tuple(
            SeenPicture(
                sheet.picture(self.start_image, n), sheet.picture(self.result_image, n), sheet.cut(self.counted, n)
            )
            for n in range(len(sheet))
        )
