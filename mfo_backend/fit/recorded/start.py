# SPDX-License-Identifier: Apache-2.0
"""Stages `scan` and `start`: solutions from nothing, on a first recording that is good for any material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...render.camera.primary_rays import TILE
from ...render.paths.recorded_paths import LaneGroups
from ...render.paths.recorded_scene import MOST_LANES
from ...types.errors import UnrecordableError
from ..result.course import Stage
from ..search.global_start import (
    FURTHER_LOBES,
    LOBE_BEGINS,
    LOBE_STARTS,
    ROUGHER_WIDTH,
    agreeing_ends,
    best_starts,
    different_nodes,
    random_start,
    scan,
    scan_lobe,
)
from ..search.race_starts import race
from ..squares.problem import Problem
from ..squares.residuals import log_residual
from .recording import Recording, Setting, Vector
from .scanned_values import Placed, best_scanned, placed
from .solve import solve
from .where_to_look import all_groups, detail_grid, edges_of_light, fewer_groups, thinned_grid

SPARE = 1.5  # times the lanes a start is found on are recorded for it: its tiles are chosen by what they show


@dataclass(frozen=True, eq=False)
class Started:
    """Where the search from nothing has ended.

    Attributes
    ----------
    recording
        The first recording where every light is exact; None where light is sampled, for there each solution gets one.
    basins
        The best solution first, then different ones that cost little more.
    edges
        Pixels where a sliver may be all that is lit, True (height, width); None where nothing is looked at there.
    """

    recording: Recording | None
    basins: tuple[Vector, ...]
    edges: NDArray[np.bool_] | None


def start_from_nothing(setting: Setting) -> Started:
    """Solutions from the scan's nodes, the scene's material and a random one.

    Raises
    ------
    UnrecordableError
        If no start gives finite numbers.
    """
    plan, course, make = setting.plan, setting.course, setting.censored(log_residual)
    with course.stage("scan") as stage:
        recording, edges = _first_recording(setting)
        groups = _groups(recording)
        stage.picture = None if recording.thinned else recording.preview  # others have no picture for first guesses
        lanes = plan.scan_lanes if setting.sampled else plan.exact_scan_lanes
        few = recording.problem(fewer_groups(groups, setting.reference, lanes), make, calm=True)
        scanned = best_scanned(setting, recording)
        starts = _starts(setting, few, stage, scanned[0])
        stage.vector = starts[0] if starts else None
    with course.stage("start") as stage:
        if not recording.thinned:
            stage.picture = recording.preview
        lanes = plan.start_lanes if setting.sampled else plan.exact_start_lanes
        more = recording.problem(fewer_groups(groups, setting.reference, lanes), make, calm=True)
        users = [placed(setting.user, values) for values in scanned]
        others = [*users, placed(random_start(setting.table, setting.seed), scanned[0])]
        basins = race(
            lambda x, evaluations, known: solve(setting, more, x, evaluations, stage=stage, known=known),
            [*starts, *others], setting.table, plan, course.should_stop,
        )  # fmt: skip
        if not np.isfinite(basins[0].equations.cost):
            raise UnrecordableError("No start of the fit gives finite numbers on the recorded light paths.")
        stage.vector = basins[0].x
        course.show(stage, stage.vector)  # near the result, and what makes sure of it takes as long again
    return Started(None if setting.sampled else recording, tuple(basin.x for basin in basins), edges)


def _first_recording(setting: Setting) -> tuple[Recording, NDArray[np.bool_] | None]:
    """The recording for any material, and the edges of light that it was made for."""
    plan, reference, mask, user = setting.plan, setting.reference, setting.mask, setting.user
    if setting.sampled:
        enough = SPARE * plan.start_lanes
        return setting.record(user, plan.grid_first, 0, near=False, samples=1, enough=enough), None
    # only the pixel's footprint is sampled
    grid = detail_grid(reference, mask)
    some = thinned_grid(grid, reference, mask, plan.refine_lanes)
    thinned = not (some[mask] > 0).all()
    recording = setting.record(user, some, 0, near=False, samples=1, thinned=thinned, enough=MOST_LANES)
    edges = None if thinned else edges_of_light(recording.paths, _groups(recording))
    if edges is None:
        return recording, None
    del recording
    return setting.record(user, detail_grid(reference, mask, edges), 1, near=False), edges


def _groups(recording: Recording) -> LaneGroups:
    if recording.setting.sampled:
        return all_groups(recording.paths, TILE)
    return all_groups(recording.paths, 1, recording.setting.reference)


def _starts(setting: Setting, problem: Problem, stage: Stage, values: Placed) -> list[Vector]:
    """Where two opposite starts agree, their ends; else the best nodes of the scan. All begin at these `values`."""
    plan, table, scanned, course = setting.plan, setting.table, setting.scene.model.scanned, setting.course
    residuals = course.watch(stage, problem.equations)
    starts: list[Vector] = []
    if plan.same_cost:
        evaluations = plan.agreement_evaluations if setting.sampled else plan.exact_agreement_evaluations
        exact = {} if setting.sampled else {"metal_width": ROUGHER_WIDTH, "most": 0.5 * plan.seen_rms**2}
        starts = agreeing_ends(
            lambda start: solve(setting, problem, placed(start, values), evaluations, stage=stage),
            table, scanned, plan.same_cost, **exact,
        )  # fmt: skip
    if not starts and plan.scan:
        nodes = scan(residuals, table, scanned, course.should_stop)
        starts = [placed(start, values) for start in best_starts(nodes, plan.starts)]
    begins = starts[:LOBE_BEGINS]
    for lobe in FURTHER_LOBES:
        nodes = scan_lobe(residuals, table, lobe, begins, course.should_stop)
        starts += [node.x for node in different_nodes(nodes, LOBE_STARTS)]
    return starts
