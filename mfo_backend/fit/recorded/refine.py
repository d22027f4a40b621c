# SPDX-License-Identifier: Apache-2.0
"""Stage `refine`: all residuals, on a recording near the solution, and what else the picture may show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...solve.bounded_least_squares import Solution
from ..alike.exchanges import best_basin, metal_rivals, taken_for, width_rivals
from ..alike.simplest import OtherEnds
from ..alike.unneeded_lobes import Box, solve_without_unneeded
from ..plans import NEAR_EVALUATIONS
from ..result.course import Stage
from ..squares.problem import Problem, Refined
from ..squares.residuals import log_residual
from .recording import SAMPLES, Recording, Setting, Vector
from .solve import better_basin, solve
from .start import Started
from .where_to_look import all_groups, fewer_groups, finer_grid, solution_grid

EVALUATIONS_EXACT = 15
# At the solution, until it holds still. Of 12 targets that light themselves none makes more than four
# (docs/notebook/recorded_paths.md). Smaller: what moves far ends beside the truth
MOST_RECORDINGS = 5
# After a solve its recording is too old if the tiles changed by this share, or if its own noise grew by this factor.
# The first is what mends fits that began far away, though most of those keep their samples; the second finds a lobe
# that became narrow in few tiles.
MOVED = 0.15
NOISIER = 1.25
# The same where light that returns to the target has changed by this part of all light, which a recording follows by an
# albedo alone: at 0.008 a lampshade was 1.1 % off (docs/notebook/recorded_paths.md). Smaller: more recordings
RETURNED = 0.005


@dataclass(frozen=True, eq=False)
class OnRecording:
    """The end of the stage with the recording it was found on."""

    refined: Refined
    recording: Recording


def refine_exact(setting: Setting, started: Started) -> OnRecording:
    """The end where every light is exact, and so every recording as good as another of as many rays."""
    recording, start = started.recording, started.basins[0]
    assert recording is not None
    with setting.course.stage("refine") as stage:
        grid = None
        if not recording.thinned:
            first = recording.picture
            grid = solution_grid(setting.reference, setting.mask, lambda: first(start), started.edges)
            if grid is not None:
                recording = setting.record(start, grid, recording.number + 1)
            stage.picture = recording.preview
        groups = all_groups(recording.paths, 1, setting.reference)
        groups = fewer_groups(groups, setting.reference, setting.plan.refine_lanes)
        problem = recording.problem(groups, setting.censored(log_residual))

        def solve_below(x: Vector, wanted: float) -> Solution:
            return solve(setting, problem, x, setting.plan.other_evaluations, stage=stage, wanted=wanted)

        table = setting.table
        found = best_basin(solve_below, solve(setting, problem, start, EVALUATIONS_EXACT, stage=stage), table)
        found, rivals = metal_rivals(problem, solve_below, found, table)
        stage.vector = found.x
    return _with_width_rivals(OnRecording(Refined(found.x, problem, problem, rivals=rivals), recording))


def refine_sampled(setting: Setting, basins: Sequence[Vector]) -> OnRecording:
    """The end where light is sampled, on a new and finer recording near it.

    There, residuals count in standard deviations of the reference's noise. Solutions in other basins, all but the first
    of `basins`, are tried again: they may have cost more by the noise of the first recording alone.
    """
    start, *others = basins
    with setting.course.stage("refine") as stage:
        recording, x, grid = _recorded_near(setting, stage, start, 0)
        stage.vector = x
        if (graph := setting.scene.graph) is not None:  # extrapolated on the way, and perhaps wrong where it led
            graph.settle(x[len(x) - graph.table.length :])
        # the first weights came from a model that was still off
        found = _problems(recording, x, solve_all=True)
        others = [*others, *(taken_for(x, setting.table) if setting.plan.alike else ())]
        rival = better_basin(setting, found.refined.few, x, others)
        if rival is not None:
            known, number = found.refined.few.equations(x).cost, recording.number
            del found, recording
            recording, better, _ = _recorded_near(setting, stage, rival, number)
            found = _problems(recording, better, solve_all=True)
            if found.refined.few.equations(better).cost >= known:
                # what had made it look better was the noise of a recording for another material
                number = recording.number
                del found, recording
                stage.picture = None
                recording = setting.record(x, grid, number + 1)
                stage.picture = recording.preview
                found = _problems(recording, x, solve_all=True)
        refined = _last_steps(setting, stage, found.refined)
        stage.vector = refined.x
    return _with_width_rivals(replace(found, refined=refined))


def _recorded_near(setting: Setting, stage: Stage, start: Vector, number: int) -> tuple[Recording, Vector, int]:
    """A recording made anew until it is near the solution on some of its tiles, that solution, and its grid.

    `number` is how many recordings there were before.
    """
    plan, last, grid = setting.plan, number + MOST_RECORDINGS, setting.plan.grid_last
    finest = partial(setting.scene.finest_grid, SAMPLES)
    while True:
        number += 1
        stage.picture = None  # it holds the recording before this one
        recording = setting.record(start, grid, number)
        stage.picture = recording.preview
        few = _problems(recording, start).refined.few
        x = solve(setting, few, start, NEAR_EVALUATIONS, stage=stage).x
        before, after = few.own_noise(start), few.own_noise(x)
        old = _is_old(recording, few.change(start, x), x) or after > NOISIER * before
        finer = finer_grid(grid, after, few.own_share(x), plan, finest)
        if not (old or finer > grid) or number == last or setting.course.should_stop():
            return recording, x, grid
        del few, recording
        start, grid = x, finer


def _is_old(recording: Recording, change: float, x: Vector) -> bool:
    """Whether `x`, by which tiles have changed by a share, asks for a new recording."""
    scene = recording.setting.scene
    returned = max(change * scene.needs.held, scene.returned_change(recording.paths, x))
    return change > MOVED or returned > RETURNED


def _problems(recording: Recording, x: Vector, *, solve_all: bool = False) -> OnRecording:
    """All tiles of the last stage and some of them, weighted by the noise that the model `x` leaves.

    With `solve_all`, the picture for that noise brings all tiles' derivatives at `x`, where their solve begins.
    """
    plan = recording.setting.plan
    side, groups = plan.side_last, recording.tiles(plan.side_last)
    some = np.arange(0, len(groups), max(len(groups) // plan.first_tiles, 1))
    pixels = recording.pixels_and_tiles(x, groups) if solve_all else recording.pixels(x)
    noise = recording.noise(pixels, side)
    weighing, fewer = (recording.weighing(n, side) for n in (noise, noise.take(some)))
    problem = recording.problem(groups, weighing, near=x)
    few = problem if len(some) == len(groups) else recording.problem(groups.take(some), fewer, near=x)
    return OnRecording(Refined(x, problem, few), recording)


def _last_steps(setting: Setting, stage: Stage, refined: Refined) -> Refined:
    """The solution on all tiles without lobes nobody asks for."""
    x, problem, table, user = refined.x, refined.all, setting.table, setting.user

    def other_end(problem: Problem, start: Vector, box: Box) -> Vector:
        return solve(setting, problem, start, NEAR_EVALUATIONS, stage=stage, box=box, wanted=np.inf).x

    found, off = solve_without_unneeded(
        lambda start, box: solve(setting, problem, start, NEAR_EVALUATIONS, stage=stage, box=box),
        problem.equations(x), problem.independent, x, user, table,
    )  # fmt: skip
    return OtherEnds(other_end, user, table).simplest(replace(refined, x=found.x, off=off))


def _with_width_rivals(found: OnRecording) -> OnRecording:
    """With the rivals of a model whose lobes cannot be as narrow as they may be asked to be."""
    setting, refined = found.recording.setting, found.refined
    if not setting.scene.model.limited_width:
        return found
    more = width_rivals(refined.all, refined.x, setting.table)
    return replace(found, refined=replace(refined, rivals=(*refined.rivals, *more)))
