# SPDX-License-Identifier: Apache-2.0
"""What a result on a contact sheet is in each of its pictures: errors and verdicts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...render.sheet.contact_sheet import ContactSheet
from ...types.image import Encoding, Image, Pixels
from ...types.result import PictureResult
from ..judge.fit_task import FitTask
from ..judge.picture_errors import picture_errors
from ..judge.verdict import judge

Errors = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class SheetJudge:
    """Looks at those pictures of a sheet that show the target; `start` and `end` are radiance over the sheet."""

    task: FitTask
    sheet: ContactSheet
    start: Pixels = field(repr=False)
    end: Pixels = field(repr=False)

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The pictures that show the target, counted from 0."""
        return tuple(n for n in range(len(self.sheet)) if self.sheet.cut(self.task.mask, n).any())

    @cached_property
    def errors(self) -> tuple[Errors, ...]:
        """Those of each picture, as `judge.picture_errors` has them."""
        return tuple(
            picture_errors(reference, first, last, mask, counted, self.task.display)
            for reference, mask, counted, (first, last) in self._each(self.start, self.end)
        )

    @property
    def mean_errors(self) -> Errors:
        """Means over the pixels of all pictures."""
        weights = [self.sheet.cut(self.task.counted, number).sum() for number in self.numbers]

        def mean(name: str, which: int) -> float:
            return float(np.average([errors[name][which] for errors in self.errors], weights=weights))

        return {name: (mean(name, 0), mean(name, 1)) for name in self.errors[0]}

    def results(
        self, shown: Pixels, *, noted: bool, others: NDArray[np.bool_] | None = None
    ) -> tuple[PictureResult, ...]:
        """Errors and verdict of each picture of what is `shown`, the end or the start; `others` as of `judge`."""
        kept = shown is self.start
        errors = [{n: (e[0], e[0] if kept else e[1]) for n, e in of.items()} for of in self.errors]
        beside = [None if others is None else np.ascontiguousarray(self.sheet.cut(others, n)) for n in self.numbers]
        judgements = [
            judge(reference, light, mask, self.task.view, noted=noted, others=fitted)
            for (reference, mask, _, (light,)), fitted in zip(self._each(shown), beside, strict=True)
        ]
        labels = [self.sheet.labels[number] for number in self.numbers]
        return tuple(PictureResult(*each) for each in zip(labels, errors, judgements, strict=True))

    def _each(self, *light: Pixels) -> Iterator[tuple[Image, NDArray[np.bool_], NDArray[np.bool_], list[Pixels]]]:
        """Reference, masks and radiance of each picture, as its reference has them."""
        reference = self.task.reference
        own = self.sheet.picture if reference.encoding is Encoding.LINEAR else self.sheet.cut
        for number in self.numbers:
            counts = None if reference.counts is None else self.sheet.cut(reference.counts, number)
            target = Image(np.ascontiguousarray(own(reference.pixels, number)), reference.encoding, counts=counts)
            mask, counted = (
                np.ascontiguousarray(self.sheet.cut(m, number)) for m in (self.task.mask, self.task.counted)
            )
            yield target, mask, counted, [np.ascontiguousarray(own(pixels, number)) for pixels in light]
