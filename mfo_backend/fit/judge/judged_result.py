# SPDX-License-Identifier: Apache-2.0
"""A fit's result with its verdict: what is said of it and of its values, and the start where that is better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import View
from ...types.certainty import Certainty, Level
from ...types.image import Image, Pixels
from ...types.parameter import Value
from ...types.result import FitResult, PictureResult
from ...types.status import Status
from ...types.verdict import Cause, Verdict
from ..result.outcome import START_KEPT
from .verdict import difference_of, is_worse, judge, worst_judgement

FILE_ROUNDING = 1e-6  # relative to a value and to 1: float32 from file to file


def judged_result(
    result: FitResult,
    reference: Image,
    start: Pixels,
    end: Pixels,
    mask: NDArray[np.bool_],
    view: View,
    *,
    noted: bool = False,
    others: NDArray[np.bool_] | None = None,
    judge_all: Callable[[Pixels], tuple[PictureResult, ...]] | None = None,
) -> tuple[FitResult, Pixels]:
    """The result with its verdict, and its picture: of the start where the end is farther from the reference.

    Pictures are scene-linear, `mask` sees the target, `others` what is fitted with it, and `noted` says that the export
    has left something out. Where the picture is a sheet of several, `judge_all` says what the result is in each of
    them. Under a verdict of `different` the status says so too. No value is called determined but under `same`, and
    under `close` where noise alone is the reason.
    """
    judgement = found = None
    if judge_all is None:
        judgement = judge(reference, end, mask, view, noted=noted, others=others)
        found = None if judgement is None else judgement.target
    elif result.errors["flip"][1] > result.errors["flip"][0]:
        found = difference_of(reference, end, mask, view)
    if has_moved(result) and is_worse(reference, start, found, mask, view):
        errors = {name: (before, before) for name, (before, _) in result.errors.items()}
        result = replace(
            result, recovered=dict(result.initial), errors=errors, certainty={}, weak_combinations=(),
            next_picture=None,
            message=f"{result.status.sentence} {START_KEPT}",
        )  # fmt: skip
        end = start
        if judge_all is None:
            judgement = judge(reference, end, mask, view, noted=noted, others=others)
    if judge_all is not None:
        result = replace(result, pictures=judge_all(end))
        judgement = worst_judgement(result.pictures)
        said = result.contradiction
        if judgement is not None and said is not None and judgement.picture in said.pictures:
            judgement = replace(judgement, cause=None)  # the contradiction is it
    if judgement is None:
        return replace(result, certainty=_said(result, doubted=False)), end
    different = judgement.verdict is Verdict.DIFFERENT
    # values make up for what the fit does not know, and a deviation holds noise alone: of balls whose highlights Cycles
    # had clamped a colour of 0.16 was determined at 0.02 +- 0.013, under `close` (docs/notebook/wild.md)
    doubted = judgement.verdict is not Verdict.SAME and judgement.cause is not Cause.NOISE
    return replace(
        result,
        judgement=judgement,
        status=Status.DIFFERENT if different and result.status.exit_code == 0 else result.status,
        message=judgement.sentence + result.message.removeprefix(result.status.sentence),
        certainty=_said(result, doubted=doubted),
    ), end


def has_moved(result: FitResult) -> bool:
    """Whether a value of a result is another than at its start."""
    return any(moved(result.initial.get(name), value) for name, value in result.recovered.items())


def moved(before: Value | None, after: Value | NDArray[np.float64]) -> bool:
    """Whether a value is another one, and not the same from another file."""
    return before is None or not np.allclose(before, after, rtol=FILE_ROUNDING, atol=FILE_ROUNDING)


def _said(result: FitResult, *, doubted: bool) -> dict[str, Certainty]:
    """Certainties in words that are true: `not visible` is a value that was kept, `determined` one of a true result."""
    said = {}
    for name, certainty in result.certainty.items():
        level = certainty.level
        if level is Level.NOT_VISIBLE and moved(result.initial.get(name), result.recovered[name]):
            level = Level.NOT_TOLD_APART
        elif level is Level.DETERMINED and doubted:
            level = Level.DOUBTFUL
        said[name] = replace(certainty, level=level)
    return said
