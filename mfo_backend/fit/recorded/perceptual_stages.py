# SPDX-License-Identifier: Apache-2.0
"""What follows the least squares of `balanced` and `best`: perceptual residuals, FLIP, and what is worth a look."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...types.image import Pixels
from ..judge.minimise_flip import minimise_flip
from ..judge.picture_judge import PictureJudge
from ..result.outcome import End
from ..settings import FitSettings
from ..squares.problem import Problem
from ..squares.residuals import MakeResidual
from .stages import RecordedFit, Vector

BASIN = 0.1  # of the box: solutions nearer than this in every value are one
FLIP_STARTS = 2
FINALISTS = 2  # ends that are path-traced besides the start and the end of the least squares


def perceptual_ends(
    fit: RecordedFit,
    problem: Problem,
    start: Vector,
    basins: Sequence[Vector],
    residuals: Mapping[str, MakeResidual],
    judge: PictureJudge,
    settings: FitSettings,
    notes: list[str],
) -> list[End]:
    """The best ends of the perceptual stages from `start` and other `basins`, by the judge on recorded pictures.

    Losses that the settings name are a ladder, each from the end of the one before; a preset's own are alternatives.
    """
    flip = settings.preset == "best"
    fit.record_whole(start)
    starts = [start]
    for basin in basins:
        starts.append(fit.solve_within(problem, np.clip(basin, *fit.box), *fit.box))
    ends = [End("refine", x) for x in starts[1:]]
    for name, make in residuals.items():
        polished = fit.polish(name, problem, make, starts)
        if polished is None:
            notes.append(f"The stage {name!r} met numbers that are not finite and was left out.")
        else:
            ends += [End(name, x) for x in polished]
            starts = starts if settings.losses is None else polished
    if not fit.complete:
        if flip:
            notes.append("The picture is too large to be recorded whole: the stage 'flip' was left out.")
        return ends
    if flip and not fit.course.should_stop():
        nearest: list[Vector] = []
        width = fit.table.upper - fit.table.lower
        for x in sorted([start, *(end.x for end in ends)], key=lambda x: judge.value(fit.picture(x))):
            if all(np.max(np.abs(x - other) / width) > BASIN for other in nearest):
                nearest.append(x)
        ends += [End("flip", x) for x in _lower_flip(fit, judge, nearest[:FLIP_STARTS])]
    if len(ends) <= FINALISTS:
        return ends
    return sorted(ends, key=lambda end: judge.value(fit.picture(end.x)))[:FINALISTS]


def _lower_flip(fit: RecordedFit, judge: PictureJudge, starts: list[Vector]) -> list[Vector]:
    """Stage `flip`: the mean error of the recorded picture itself, from each start."""
    paths, course = fit.paths, fit.course
    evaluate = fit.scene.evaluator(paths, paths.pixel_groups())

    def picture(x: Vector) -> tuple[Pixels, Callable[[Pixels], Vector]]:
        table = evaluate(x)

        def pullback(gradient: Pixels) -> Vector:
            rows = gradient.reshape(-1, 3)[paths.pixel].astype(np.float64)
            return np.einsum("gck,gc->k", table[:, :, 1:], rows, optimize=True)

        return fit.shown(table[:, :, 0]), pullback

    with course.stage("flip") as stage:
        told, stop = course.values(stage), course.should_stop
        ends = [minimise_flip(judge, picture, x, *fit.box, on_value=told, should_stop=stop) for x in starts]
        stage.vector = min(ends, key=lambda end: end[1])[0]
    return [x for x, _ in ends]
