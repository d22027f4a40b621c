# SPDX-License-Identifier: Apache-2.0
"""The least-squares stages of the presets `fast` and `balanced`, from a scan to the last refinement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..render.recorded_paths import LaneGroups, RecordedPaths
from ..render.recorded_scene import RecordedScene
from ..solve.bounded_least_squares import NormalEquations, Solution, SolveLimits, solve_bounded
from ..types.image import Pixels
from .choose_groups import all_groups, detail_grid, fewer_groups
from .course import Course
from .global_start import different_nodes, scan
from .residuals import ImageAndJacobian, OneSidedResidual, Residual, normal_equations

Vector = NDArray[np.float64]
MakeResidual = Callable[[NDArray[np.float32]], Residual]


@dataclass(frozen=True)
class RecordedPlan:
    """How much a recorded fit does.

    Attributes
    ----------
    scan
        Whether to look for starts; without it only the scene's own material and a random one are tried.
    grid_first, grid_last
        Squared: camera rays a pixel of the first recording and of the one at the solution, where light is sampled.
    scan_lanes, start_lanes
        Recorded lanes the scan and the fits from its nodes look at.
    refine_lanes
        Those the last stage looks at where every light is exact: without noise more of them say nothing new.
    starts
        Nodes of the scan to start from, besides the best two metals, the material in the scene and a random one.
    trial_evaluations
        After as many only starts within `keep_factor` of the best cost go on.
    solved_rms
        Root mean square of the log residual at which no other start is tried: half a per cent cannot be seen.
    """

    scan: bool = True
    grid_first: int = 4
    grid_last: int = 8
    scan_lanes: int = 20_000
    start_lanes: int = 80_000
    refine_lanes: int = 160_000
    starts: int = 3
    trial_evaluations: int = 10
    keep_factor: float = 10.0
    solved_rms: float = 5e-3


@dataclass(frozen=True)
class Problem:
    """One least-squares problem: what to average, against what."""

    evaluate: ImageAndJacobian
    residual: Residual
    groups: LaneGroups

    @property
    def equations(self) -> Callable[[Vector], NormalEquations]:
        """The normal equations as a function of the vector."""
        return normal_equations(self.evaluate, self.residual)


class RecordedFit:
    """The stages of one fit; `reference` is scene-linear, `mask` holds the pixels that see the target.

    `clipped` is 1 where the radiance is only known to be the reference's or more, else 0, (height, width, 3).
    """

    def __init__(
        self,
        scene: RecordedScene,
        reference: Pixels,
        mask: NDArray[np.bool_],
        plan: RecordedPlan,
        seed: int,
        course: Course,
        clipped: NDArray[np.float32] | None = None,
    ) -> None:
        self.scene, self.reference, self.mask = scene, reference, mask
        self.plan, self.seed, self.course, self.clipped = plan, seed, course, clipped
        self.paths: RecordedPaths
        self.table = scene.renderer.table

    def problem(self, groups: LaneGroups, make: MakeResidual) -> Problem:
        """The residuals of these groups of the present recording."""
        residual = make(groups.average(self.reference))
        if self.clipped is not None:
            residual = OneSidedResidual(residual, groups.average(self.clipped) > 0)
        return Problem(self.scene.evaluator(self.paths, groups), residual, groups)

    def start_from_nothing(self, make: MakeResidual) -> Solution:
        """Stages `scan` and `start`: the best solution from the scan's nodes, the scene's material and a random one."""
        plan, renderer = self.plan, self.scene.renderer
        sampled = self.scene.needs.sampled
        with self.course.stage("scan") as stage:
            # where every light is exact, only the pixel's footprint is sampled
            grid = plan.grid_first if sampled else detail_grid(self.reference, self.mask)
            self.paths = self.scene.record(renderer.start, grid=grid, seed=self.seed, near=False)
            groups = all_groups(self.paths, tiles=sampled)
            few = self.problem(fewer_groups(groups, self.reference, plan.scan_lanes), make)
            nodes = []
            if plan.scan:
                nodes = scan(self.course.watch(stage, few.equations), self.table, self.scene.model.scanned)
                stage.vector = nodes[0].x
        with self.course.stage("start") as stage:
            more = self.problem(fewer_groups(groups, self.reference, plan.start_lanes), make)
            watched = self.course.watch(stage, more.equations)
            starts = [node.x for node in different_nodes(nodes, plan.starts)]
            metals = [node for node in nodes if node.metal]
            starts += [node.x for node in metals[:2] if not any(node.x is x for x in starts)]
            starts += [renderer.start, _random_start(self.table.lower, self.table.upper, self.seed)]
            best = self._race(watched, starts)
            stage.vector = best.x
        return best

    def _race(self, residuals: Callable[[Vector], NormalEquations], starts: list[Vector]) -> Solution:
        """Bounded fits from all starts; those that fall behind are given up, and all others once one has solved it."""
        plan, found = self.plan, []
        for start in starts:
            first = self._solve(residuals, start, plan.trial_evaluations)
            found.append(first)
            if self._solved(first) or self.course.should_stop():
                break
        found.sort(key=lambda solution: solution.equations.cost)
        leader = found[0]
        for candidate in list(found):
            behind = candidate.equations.cost > plan.keep_factor * leader.equations.cost
            if candidate.converged or behind or self._solved(leader) or self.course.should_stop():
                continue
            longer = self._solve(residuals, candidate.x, 40)
            if longer.equations.cost < leader.equations.cost:
                leader = longer
        return leader

    def _solved(self, solution: Solution) -> bool:
        return np.sqrt(2.0 * solution.equations.cost) < self.plan.solved_rms

    def _solve(self, residuals: Callable[[Vector], NormalEquations], start: Vector, evaluations: int) -> Solution:
        # a cost of 1e-11 is a relative error of 5e-6 a pixel: below it float32 leaves nothing to gain
        limits = SolveLimits(evaluations=evaluations, cost_change=1e-5, cost_floor=1e-11)
        return solve_bounded(residuals, start, self.table.lower, self.table.upper, limits, self.course.should_stop)

    def solve_within(self, problem: Problem, start: Vector, lower: Vector, upper: Vector) -> Vector:
        """A few steps with other bounds."""
        limits = SolveLimits(evaluations=8, cost_change=1e-5, cost_floor=1e-11)
        return solve_bounded(problem.equations, start, lower, upper, limits, self.course.should_stop).x

    def refine(self, start: Vector, make: MakeResidual) -> tuple[Solution, Problem]:
        """Stage `refine`: all residuals, on a new and finer recording near the solution where the light is sampled."""
        with self.course.stage("refine") as stage:
            sampled = self.scene.needs.sampled
            if sampled:
                self.paths = self.scene.record(start, grid=self.plan.grid_last, seed=self.seed + 1, near=True)
            groups = all_groups(self.paths, tiles=sampled)
            if not sampled:
                groups = fewer_groups(groups, self.reference, self.plan.refine_lanes)
            problem = self.problem(groups, make)
            solution = self._solve(self.course.watch(stage, problem.equations), start, 15)
            stage.vector = solution.x
        return solution, problem

    def polish(self, name: str, groups: LaneGroups, make: MakeResidual, start: Vector) -> Solution:
        """A stage with another residual on the same recording."""
        with self.course.stage(name) as stage:
            residual = make(groups.average(self.reference))
            problem = Problem(self.scene.evaluator(self.paths, groups), residual, groups)
            solution = self._solve(self.course.watch(stage, problem.equations), start, 25)
            stage.vector = solution.x
        return solution


def _random_start(lower: Vector, upper: Vector, seed: int) -> Vector:
    return lower + (upper - lower) * np.random.default_rng(seed).uniform(0.1, 0.9, len(lower))
