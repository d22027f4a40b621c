# SPDX-License-Identifier: Apache-2.0
"""The last stages of a fit on traced paths, where the best squares leave more of a difference than noise is: squares
of what an eye sees, then FLIP."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...solve.bounded_least_squares import SolveLimits, solve_bounded
from ...types.parameter import Vector
from ..judge.minimise_flip import minimise_flip
from ..judge.picture_judge import PictureJudge
from ..plans import PERCEPTUAL_EVALUATIONS
from ..result.course import Course
from ..squares.recording_noise import unbiased_equations
from ..squares.residuals import MakeResidual
from .linear_pictures import LinearPicture, LinearPictures

FLIP = "flip"
ROUNDS = 2  # linear pictures of the stage `flip`; a third changed nothing
SHORT_WAY = 0.01  # of the range: a shorter way needs no other picture
STAGE_COST_CHANGE = 1e-4  # relative, of a step that ends them


def lower_seen_error(
    pictures: LinearPictures,
    judge: PictureJudge,
    residuals: Mapping[str, MakeResidual],
    start: Vector,
    kept: NDArray[np.bool_],
    course: Course,
    *,
    flip: bool,
) -> Vector:
    """The point near `start` of lower error by `judge`, with the values of `kept` as they are; else `start`.

    A stage for each of the `residuals`, by its name, minimises their squares over tiles; they are alternatives. With
    `flip` the error itself is minimised from the best of them, and once more on a new picture there. All searches are
    in units of a small box and end early: one in units of the whole range follows the reference's noise further
    (docs/notebook/glass.md).
    """
    picture = pictures.around(start, 1)
    if picture is None:
        return start
    ends = [start]
    for name, make in residuals.items():
        ends += _lower_squares(pictures, picture, name, make, start, kept, course)
    best = min(ends, key=lambda x: judge.value(picture.image(x)))
    return _lower_flip(pictures, picture, judge, best, kept, course) if flip else best


def _lower_squares(
    pictures: LinearPictures,
    picture: LinearPicture,
    name: str,
    make: MakeResidual,
    start: Vector,
    kept: NDArray[np.bool_],
    course: Course,
) -> list[Vector]:
    residual = make(pictures.tiles.reference)
    with course.stage(name) as stage:
        equations = course.watch(stage, unbiased_equations(picture.of_tiles(), residual, start))
        limits = SolveLimits(evaluations=PERCEPTUAL_EVALUATIONS, cost_change=STAGE_COST_CHANGE)
        try:
            stage.vector = solve_bounded(equations, start, *pictures.box(start, kept), limits, course.should_stop).x
        except ValueError:  # a response may not be finite where a picture is
            return []
    return [stage.vector]


def _lower_flip(
    pictures: LinearPictures,
    picture: LinearPicture,
    judge: PictureJudge,
    start: Vector,
    kept: NDArray[np.bool_],
    course: Course,
) -> Vector:
    x, width = start, pictures.width
    with course.stage(FLIP) as stage:
        for turn in range(1, 1 + ROUNDS):
            told, stop, box = partial(course.note, stage), course.should_stop, pictures.box(x, kept)
            new, _ = minimise_flip(judge, picture, x, *box, on_value=told, should_stop=stop)
            moved = float(np.max(np.abs(new - x) / width))
            x = stage.vector = new
            following = pictures.around(x, turn + 1) if turn < ROUNDS and moved >= SHORT_WAY else None
            if following is None:
                break
            picture = following
    return x
