# SPDX-License-Identifier: Apache-2.0
"""What follows the least squares of `balanced` and `best`: perceptual residuals, FLIP, and what is worth a look."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...types.image import Pixels
from ..alike.unneeded_lobes import Box, box_holding
from ..judge.minimise_flip import minimise_flip
from ..judge.picture_judge import PictureJudge
from ..plans import PERCEPTUAL_EVALUATIONS
from ..result.outcome import End
from ..search.race_starts import different
from ..settings import FitSettings
from ..squares.problem import Problem
from ..squares.residuals import MakeResidual
from .keep_user_values import Kept
from .recording import Recording, Vector
from .refine import OnRecording
from .solve import solve, solve_within

FLIP_STARTS = 2
FINALISTS = 2  # ends that are path-traced besides the start and the end of the least squares


def perceptual_ends(
    end: OnRecording,
    kept: Kept,
    basins: Sequence[Vector],
    residuals: Mapping[str, MakeResidual],
    judge: PictureJudge,
    settings: FitSettings,
) -> tuple[list[End], list[str]]:
    """The best ends of the perceptual stages from what was `kept` of the stage before and from other `basins`, by the
    judge on recorded pictures, and sentences on what was left out.

    Losses that the settings name are a ladder, each from the end of the one before; a preset's own are alternatives.
    """
    recording, problem, notes = end.recording.whole, end.refined.all, []
    setting, flip = recording.setting, settings.preset == "best"
    box = box_holding(setting.table, setting.user, kept.held)
    starts = [kept.x, *(solve_within(setting, problem, np.clip(basin, *box), box) for basin in basins)]
    ends = [End("refine", x) for x in starts[1:]]
    for name, make in residuals.items():
        polished = _lower_squares(recording, name, problem, make, starts, box)
        if not polished:
            notes.append(f"The stage {name!r} met numbers that are not finite and was left out.")
        else:
            ends += [End(name, x) for x in polished]
            starts = starts if settings.losses is None else polished
    if not recording.complete:
        if flip:
            notes.append("The picture is too large to be recorded whole: the stage 'flip' was left out.")
        return ends, notes
    if flip and not setting.course.should_stop():
        nearest = sorted([kept.x, *(end.x for end in ends)], key=lambda x: judge.value(recording.picture(x)))
        starts = different(nearest, setting.table, FLIP_STARTS)
        ends += [End("flip", x) for x in _lower_flip(recording, judge, starts, box)]
    if len(ends) <= FINALISTS:
        return ends, notes
    return sorted(ends, key=lambda end: judge.value(recording.picture(end.x)))[:FINALISTS], notes


def _lower_squares(
    recording: Recording, name: str, problem: Problem, make: MakeResidual, starts: list[Vector], box: Box
) -> list[Vector]:
    """A stage with another residual of the groups of `problem`, from each start; its ends that are finite."""
    setting = recording.setting
    with setting.course.stage(name) as stage:
        stage.picture = recording.preview
        problem = replace(problem, residual=make(problem.groups.average(setting.reference)), near=starts[0])
        found = [solve(setting, problem, start, PERCEPTUAL_EVALUATIONS, stage=stage, box=box) for start in starts]
        stage.vector = min(found, key=lambda solution: solution.equations.cost).x
    return [solution.x for solution in found if np.isfinite(solution.equations.cost)]


def _lower_flip(recording: Recording, judge: PictureJudge, starts: list[Vector], box: Box) -> list[Vector]:
    """Stage `flip`: the mean error of the recorded picture itself, from each start."""
    paths, course = recording.paths, recording.setting.course
    evaluate = recording.setting.scene.evaluator(paths, paths.pixel_groups())

    def picture(x: Vector) -> tuple[Pixels, Callable[[Pixels], Vector]]:
        table = evaluate(x)

        def pullback(gradient: Pixels) -> Vector:
            rows = gradient.reshape(-1, 3)[paths.pixel].astype(np.float64)
            return np.einsum("gck,gc->k", table[:, :, 1:], rows, optimize=True)

        return recording.shown(table[:, :, 0]), pullback

    with course.stage("flip") as stage:
        stage.picture = recording.preview
        told, stop = partial(course.note, stage), course.should_stop
        ends = [minimise_flip(judge, picture, x, *box, on_value=told, should_stop=stop) for x in starts]
        stage.vector = min(ends, key=lambda end: end[1])[0]
    return [x for x, _ in ends]
