# SPDX-License-Identifier: Apache-2.0
"""What the pictures of a result say of it: errors and verdicts, on a contact sheet those of each of its pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ...render.sheet.contact_sheet import ContactSheet
from ...types.image import Encoding, Image, Pixels
from ...types.result import FitResult, PictureResult
from ..judge.fit_task import FitTask
from ..judge.judged_result import judged_result
from ..judge.picture_errors import picture_errors
from ..judge.verdict import judge

Errors = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class TaskJudge:
    """Judges the pictures of a fit's start and end, which are radiance; of a sheet each one that shows the target."""

    task: FitTask
    start: Pixels = field(repr=False)
    end: Pixels = field(repr=False)

    @property
    def errors(self) -> Errors:
        """Those of `judge.picture_errors`, means over the pixels of all pictures."""
        task, each = self.task, self._errors
        if task.sheet is None:
            return each[0]
        weights = [task.sheet.cut(task.counted, number).sum() for number in self._numbers]

        def mean(name: str, which: int) -> float:
            return float(np.average([errors[name][which] for errors in each], weights=weights))

        return {name: (mean(name, 0), mean(name, 1)) for name in each[0]}

    def judged(self, result: FitResult, others: NDArray[np.bool_] | None = None) -> tuple[FitResult, Pixels]:
        """The result with its verdict, and its picture; see `judge.judged_result`.

        What the camera sees otherwise in Cycles is not among the surroundings either.
        """
        task, otherwise = self.task, self.task.renderer.otherwise_mask()
        if otherwise.any():
            others = otherwise if others is None else others | otherwise
        return judged_result(
            result, task.reference, self.start, self.end, task.mask, task.view, noted=task.noted, others=others,
            judge_all=None if task.sheet is None else partial(self._results, task.sheet, others),
        )  # fmt: skip

    def _results(
        self, sheet: ContactSheet, others: NDArray[np.bool_] | None, shown: Pixels
    ) -> tuple[PictureResult, ...]:
        """Errors and verdict of each picture of what is `shown`, the end or the start."""
        kept = shown is self.start
        errors = [{n: (e[0], e[0] if kept else e[1]) for n, e in of.items()} for of in self._errors]
        beside = [None if others is None else np.ascontiguousarray(sheet.cut(others, n)) for n in self._numbers]
        judgements = [
            judge(reference, light, mask, self.task.view, noted=self.task.noted, others=fitted)
            for (reference, mask, _, (light,)), fitted in zip(self._each(shown), beside, strict=True)
        ]
        labels = [sheet.labels[number] for number in self._numbers]
        return tuple(PictureResult(*each) for each in zip(labels, errors, judgements, strict=True))

    @cached_property
    def _numbers(self) -> tuple[int, ...]:
        """The pictures that show the target, counted from 0."""
        sheet = self.task.sheet
        return () if sheet is None else tuple(n for n in range(len(sheet)) if sheet.cut(self.task.mask, n).any())

    @cached_property
    def _errors(self) -> tuple[Errors, ...]:
        return tuple(
            picture_errors(reference, first, last, mask, counted, self.task.display)
            for reference, mask, counted, (first, last) in self._each(self.start, self.end)
        )

    def _each(self, *light: Pixels) -> Iterator[tuple[Image, NDArray[np.bool_], NDArray[np.bool_], list[Pixels]]]:
        """Reference, masks and radiance of each picture, as its reference has them."""
        task, reference, sheet = self.task, self.task.reference, self.task.sheet
        if sheet is None:
            yield reference, task.mask, task.counted, list(light)
            return
        own = sheet.picture if reference.encoding is Encoding.LINEAR else sheet.cut
        for number in self._numbers:
            counts = None if reference.counts is None else sheet.cut(reference.counts, number)
            target = Image(np.ascontiguousarray(own(reference.pixels, number)), reference.encoding, counts=counts)
            mask, counted = (np.ascontiguousarray(sheet.cut(m, number)) for m in (task.mask, task.counted))
            yield target, mask, counted, [np.ascontiguousarray(own(pixels, number)) for pixels in light]
