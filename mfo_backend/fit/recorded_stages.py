# SPDX-License-Identifier: Apache-2.0
"""The stages of the presets `fast`, `balanced` and `best`, from a scan to FLIP."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..render.primary_rays import TILE
from ..render.recorded_paths import LaneGroups, RecordedPaths
from ..render.recorded_scene import RecordedScene
from ..solve.bounded_least_squares import NormalEquations, Solution, SolveLimits, solve_bounded
from ..types.errors import UnrecordableError
from ..types.image import Pixels
from .choose_groups import all_groups, detail_grid, fewer_groups
from .course import Course, Stage
from .fireflies import without_fireflies
from .flip_stage import minimise_flip
from .global_start import different_nodes, scan
from .picture_judge import PictureJudge
from .remembered import Remembered
from .residuals import ImageAndJacobian, OneSidedResidual, Residual, WeightedResidual, normal_equations
from .tile_noise import TileNoise, tile_noise

Vector = NDArray[np.float64]
MakeResidual = Callable[[NDArray[np.float32]], Residual]
# a residual from a reference and one over the deviation of its noise
MakeWeighted = Callable[[NDArray[np.float32], NDArray[np.float32]], Residual]

# Share of the radiance that no weight looks below: float32, quantisation, small differences of renderers
LEAST_NOISE = 0.002
# part of the cost a solution in another basin must be below to be gone on with: it takes a new recording, and the
# weights, which come from the solution that it is compared with, are only about right
CLEARLY_LOWER = 0.97
MOST_RECORDINGS = 3  # at the solution, until it holds still
FINER = 2  # rays along each axis at the solution, relative to those a start is found with
FINEST = 60
MOST_FINE_RAYS = 500_000  # above, pixels are small enough for the first recording
# After a solve its recording is too old if the tiles changed by this share, or if one over the effective number of
# samples grew by this factor. The first is what mends fits that began far away, though most of those keep their
# samples; the second finds a lobe that became narrow in few tiles.
MOVED = 0.15
FEWER = 1.5


@dataclass(frozen=True)
class RecordedPlan:
    """How much a recorded fit does.

    Attributes
    ----------
    scan
        Whether to look for starts; without it only the scene's own material and a random one are tried.
    grid_first, grid_last
        Squared: camera rays a pixel of the first recording and of the one at the solution, where light is sampled.
    side_last
        Pixels along each side of the tiles of the last stage where light is sampled. Quarters of the tiles of the
        stages before see twice the detail and lose fewer pixels to the silhouette; single pixels see too much of the
        recording's own noise.
    scan_lanes, start_lanes
        Recorded lanes the scan and the fits from its nodes look at where light is sampled.
    exact_scan_lanes, exact_start_lanes, refine_lanes
        Those that they and the last stage look at where every light is exact: without noise more say nothing new.
    starts
        Nodes of the scan to start from, besides the best two metals, the material in the scene and a random one.
    trial_evaluations
        After as many only starts within `keep_factor` of the best cost go on.
    solved_rms
        Root mean square of the log residual at which no other start is tried: half a per cent cannot be seen.
    basins, basin_factor
        Solutions the preset `best` keeps alive to the end, and how much more than the best one they may cost.
    """

    scan: bool = True
    grid_first: int = 4
    grid_last: int = 8
    side_last: int = 2
    scan_lanes: int = 20_000
    start_lanes: int = 80_000
    exact_scan_lanes: int = 8_000
    exact_start_lanes: int = 20_000
    refine_lanes: int = 80_000
    starts: int = 3
    trial_evaluations: int = 10
    keep_factor: float = 10.0
    solved_rms: float = 5e-3
    basins: int = 3
    basin_factor: float = 1.5


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


@dataclass(frozen=True)
class End:
    """Where a stage ended."""

    stage: str
    x: Vector


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
        self._groups: dict[int, LaneGroups] = {}  # tiles of the present recording by side
        self._tiles: dict[LaneGroups, Remembered] = {}
        self.noise: TileNoise | None = None  # of the reference, known after `refine` or `misfit`
        self.table = scene.renderer.table
        self.recordings = 0
        # light with extent is noisy: what a start is found on and noise is measured on; elsewhere a highlight may well
        # be a pixel wide
        self.calm, self.fireflies = without_fireflies(reference, mask) if scene.needs.sampled else (reference, 0)
        self.box = self.table.lower, self.table.upper  # of the perceptual stages, which hold what the user keeps
        course.picture = self.picture

    @property
    def complete(self) -> bool:
        """Whether the recording holds the pixels that see the target and not only some of its tiles."""
        return len(self.paths.pixel) > 0.9 * int(self.mask.sum())  # the mask has other rays at the silhouette

    def picture(self, x: Vector) -> Pixels:
        """The recorded picture of a vector, linear; the reference where nothing is recorded."""
        return self._shown(self.scene.evaluator(self.paths, self.paths.pixel_groups())(x))

    def _shown(self, table: NDArray[np.float32]) -> Pixels:
        image = self.reference.astype(np.float32).copy()
        image.reshape(-1, 3)[self.paths.pixel] = table[:, :, 0]
        return image

    def problem(self, groups: LaneGroups, make: MakeResidual, *, calm: bool = False) -> Problem:
        """The residuals of these groups of the present recording, to the reference or to it without fireflies."""
        residual = make(groups.average(self.calm if calm else self.reference))
        if self.clipped is not None:
            residual = OneSidedResidual(residual, groups.average(self.clipped) > 0)
        return Problem(self._evaluator(groups), residual, groups)

    def tiles(self, side: int) -> LaneGroups:
        """All tiles of this side of the present recording; their evaluations are remembered between problems."""
        if side not in self._groups:
            groups = all_groups(self.paths, side)
            self._groups[side] = groups
            self._tiles[groups] = Remembered(self.scene.evaluator(self.paths, groups))
        return self._groups[side]

    def _evaluator(self, groups: LaneGroups) -> ImageAndJacobian:
        if groups in self._tiles:
            return self._tiles[groups]
        return Remembered(self.scene.evaluator(self.paths, groups))

    def start_from_nothing(self, make: MakeResidual) -> list[Solution]:
        """Stages `scan` and `start`: solutions from the scan's nodes, the scene's material and a random one.

        The best one comes first; the others are different and cost little more.
        """
        plan, renderer = self.plan, self.scene.renderer
        sampled = self.scene.needs.sampled
        with self.course.stage("scan") as stage:
            # where every light is exact, only the pixel's footprint is sampled
            grid = plan.grid_first if sampled else detail_grid(self.reference, self.mask)
            self.paths = self.scene.record(renderer.start, grid=grid, seed=self.seed, near=False)
            groups = all_groups(self.paths, TILE if sampled else 1)
            lanes = plan.scan_lanes if sampled else plan.exact_scan_lanes
            few = self.problem(fewer_groups(groups, self.reference, lanes), make, calm=True)
            nodes = []
            if plan.scan:
                nodes = scan(self.course.watch(stage, few.equations), self.table, self.scene.model.scanned)
                stage.vector = nodes[0].x
        with self.course.stage("start") as stage:
            lanes = plan.start_lanes if sampled else plan.exact_start_lanes
            more = self.problem(fewer_groups(groups, self.reference, lanes), make, calm=True)
            watched = self.course.watch(stage, more.equations)
            starts = [node.x for node in different_nodes(nodes, plan.starts)]
            metals = [node for node in nodes if node.metal]
            starts += [node.x for node in metals[:2] if not any(node.x is x for x in starts)]
            starts += [renderer.start, _random_start(self.table.lower, self.table.upper, self.seed)]
            basins = self._race(watched, starts)
            if not np.isfinite(basins[0].equations.cost):
                raise UnrecordableError("No start of the fit gives finite numbers on the recorded light paths.")
            stage.vector = basins[0].x
        return basins

    def _race(self, residuals: Callable[[Vector], NormalEquations], starts: list[Vector]) -> list[Solution]:
        """Bounded fits from all starts; those that fall behind are given up, and all others once one has solved it."""
        plan, found = self.plan, []
        for start in starts:
            first = self._solve(residuals, start, plan.trial_evaluations)
            found.append(first)
            if self._solved(first) or self.course.should_stop():
                break
        found.sort(key=lambda solution: solution.equations.cost)
        leader = found[0]
        for place, candidate in enumerate(list(found)):
            behind = candidate.equations.cost > plan.keep_factor * leader.equations.cost
            if candidate.converged or behind or self._solved(leader) or self.course.should_stop():
                continue
            longer = self._solve(residuals, candidate.x, 40)
            found[place] = longer
            if longer.equations.cost < leader.equations.cost:
                leader = longer
        others = [] if self._solved(leader) else sorted(found, key=lambda solution: solution.equations.cost)
        return self._different([leader, *others])

    def _different(self, solutions: list[Solution]) -> list[Solution]:
        """The best solutions that are further apart than a tenth of the box in some value and cost little more."""
        chosen = solutions[:1]
        width = self.table.upper - self.table.lower
        for solution in solutions[1:]:
            apart = all(np.max(np.abs(solution.x - other.x) / width) > 0.1 for other in chosen)
            if apart and solution.equations.cost <= self.plan.basin_factor * chosen[0].equations.cost:
                chosen.append(solution)
        return chosen[: self.plan.basins]

    def _solved(self, solution: Solution) -> bool:
        return np.sqrt(2.0 * solution.equations.cost) < self.plan.solved_rms

    def _solve(
        self,
        residuals: Callable[[Vector], NormalEquations],
        start: Vector,
        evaluations: int,
        box: tuple[Vector, Vector] | None = None,
    ) -> Solution:
        # a cost of 1e-11 is a relative error of 5e-6 a pixel: below it float32 leaves nothing to gain
        limits = SolveLimits(evaluations=evaluations, cost_change=1e-5, cost_floor=1e-11)
        lower, upper = box or (self.table.lower, self.table.upper)
        try:
            return solve_bounded(residuals, start, lower, upper, limits, self.course.should_stop)
        except ValueError:  # a start without finite numbers: every other one is better
            nothing = np.zeros(len(start))
            return Solution(start, NormalEquations(np.inf, nothing, np.diag(nothing)), (np.inf,), True)

    def solve_within(self, problem: Problem, start: Vector, lower: Vector, upper: Vector) -> Vector:
        """A few steps with other bounds."""
        limits = SolveLimits(evaluations=8, cost_change=1e-5, cost_floor=1e-11)
        return solve_bounded(problem.equations, start, lower, upper, limits, self.course.should_stop).x

    def _rival(self, problem: Problem, solution: Solution, others: Sequence[Vector]) -> Vector | None:
        """The best of the other basins on the same problem, if it is clearly better."""
        found = [self._solve(problem.equations, x, self.plan.trial_evaluations) for x in others]
        best = min(found, key=lambda rival: rival.equations.cost, default=solution)
        return best.x if best.equations.cost < CLEARLY_LOWER * solution.equations.cost else None

    def refine(
        self, start: Vector, make: MakeResidual, weigh: MakeWeighted | None, others: Sequence[Vector] = ()
    ) -> tuple[Solution, Problem]:
        """Stage `refine`: all residuals, on a new and finer recording near the solution where the light is sampled.

        There, residuals count in standard deviations of the reference's noise by `weigh` if given, and solutions in
        other basins (`others`) are tried: they may have cost more by the noise of the first recording alone.
        """
        with self.course.stage("refine") as stage:
            if not self.scene.needs.sampled:
                grid = np.maximum(*(detail_grid(p, self.mask) for p in (self.reference, self.picture(start))))
                grid = np.maximum(np.minimum(FINER * grid, FINEST), grid)
                if np.square(grid)[self.mask].sum() <= MOST_FINE_RAYS:
                    self._record(start, grid, 1)
                groups = fewer_groups(all_groups(self.paths, 1), self.reference, self.plan.refine_lanes)
                problem = self.problem(groups, make)
                solution = self._solve(self.course.watch(stage, problem.equations), start, 15)
                stage.vector = solution.x
                return solution, problem
            solution = problem = None
            for number in range(1, MOST_RECORDINGS + 1):
                problem = None  # and with it the recording before
                self._record(start, self.plan.grid_last, number)
                fresh = self._own_variance(start)
                solution, problem = self._refine_sampled(stage, start, make, weigh)
                stage.vector = solution.x
                fewer = self._own_variance(solution.x) > FEWER * fresh
                moved = self._moved(problem, start, solution.x) > MOVED
                if not (fewer or moved) or self.course.should_stop():
                    break
                start = solution.x
            assert solution is not None
            assert problem is not None
            rival = self._rival(problem, solution, others)
            if rival is not None:
                problem = None
                self._record(rival, self.plan.grid_last, self.recordings + 1)
                solution, problem = self._refine_sampled(stage, rival, make, weigh)
                stage.vector = solution.x
        return solution, problem

    def _own_variance(self, x: Vector) -> float:
        """Mean over the tiles of one over their effective number of samples: the recording's own relative variance."""
        samples = self.scene.effective_samples(x, self.paths, self.tiles(TILE))
        return float(np.mean(1.0 / samples[samples > 0.0])) if samples.any() else 0.0

    def _record(self, x: Vector, grid: int | NDArray[np.int64], number: int) -> None:
        """Replace the recording by one near `x`; the old one is let go first, for they are what needs the memory."""
        del self.paths
        self._groups, self._tiles = {}, {}
        self.paths = self.scene.record(x, grid=grid, seed=self.seed + number, near=True)
        self.recordings = number

    def _refine_sampled(
        self, stage: Stage, start: Vector, make: MakeResidual, weigh: MakeWeighted | None
    ) -> tuple[Solution, Problem]:
        groups = self.tiles(self.plan.side_last)
        if weigh is None:
            problem = self.problem(groups, make)
            return self._solve(self.course.watch(stage, problem.equations), start, 15), problem

        def solve(x: Vector) -> tuple[Solution, Problem]:
            self.noise = self._noise(x, groups, self.plan.side_last)
            problem = self.problem(groups, self._weighing(self.noise, groups, weigh))
            return self._solve(self.course.watch(stage, problem.equations), x, 12), problem

        # the first weights come from a model that is still off
        return solve(solve(start)[0].x)

    def _noise(self, x: Vector, groups: LaneGroups, side: int) -> TileNoise:
        pixels = self.scene.evaluator(self.paths, self.paths.pixel_groups())(x)
        if groups in self._tiles:
            self._tiles[groups].note(x, groups.mean_of_pixels(pixels))
        return tile_noise(self.calm, pixels[:, :, 0], self.paths, groups, self.paths.interior, side)

    def misfit(self, x: Vector) -> float:
        """Root mean square difference of the recorded tiles from the reference, in standard deviations of the noise."""
        groups = self.tiles(TILE)
        self.noise = self._noise(x, groups, TILE)
        problem = self.problem(groups, self._weighing(self.noise, groups))
        values = problem.residual(problem.evaluate(x)[:, :, 0])[0]
        # as far as a few outliers go, it is their number that counts and not their size
        return float(np.sqrt(np.mean(np.minimum(np.abs(values), WeightedResidual.LIMIT) ** 2)))

    def _weighing(self, noise: TileNoise, groups: LaneGroups, weigh: MakeWeighted = WeightedResidual) -> MakeResidual:
        least = LEAST_NOISE * float(groups.average(self.reference).mean())
        weight = (1.0 / np.hypot(noise.deviation, max(least, 1e-12))).astype(np.float32)
        return lambda target: weigh(target, weight)

    def _moved(self, problem: Problem, before: Vector, after: Vector) -> float:
        """Root mean square change of the groups relative to their radiance and a tenth of its mean."""
        old, new = (problem.evaluate(x)[:, :, 0] for x in (before, after))
        return float(np.sqrt(np.mean(np.square((new - old) / (np.abs(new) + 0.1 * np.abs(new).mean() + 1e-12)))))

    def polish(self, name: str, groups: LaneGroups, make: MakeResidual, starts: list[Vector]) -> list[Vector] | None:
        """A stage with another residual on the same recording, from each start; None without finite numbers."""
        with self.course.stage(name) as stage:
            residual = make(groups.average(self.reference))
            problem = Problem(self._evaluator(groups), residual, groups)
            watched = self.course.watch(stage, problem.equations)
            found = [self._solve(watched, start, 25, self.box) for start in starts]
            stage.vector = min(found, key=lambda solution: solution.equations.cost).x
        finite = [solution.x for solution in found if np.isfinite(solution.equations.cost)]
        return finite or None

    def lower_flip(self, judge: PictureJudge, starts: list[Vector]) -> list[Vector]:
        """Stage `flip`: the mean error of the recorded picture itself, from each start."""
        evaluate = self.scene.evaluator(self.paths, self.paths.pixel_groups())

        def picture(x: Vector) -> tuple[Pixels, Callable[[Pixels], Vector]]:
            table = evaluate(x)

            def pullback(gradient: Pixels) -> Vector:
                rows = gradient.reshape(-1, 3)[self.paths.pixel].astype(np.float64)
                return np.einsum("gck,gc->k", table[:, :, 1:], rows, optimize=True)

            return self._shown(table), pullback

        with self.course.stage("flip") as stage:
            told = self.course.values(stage)
            stop = self.course.should_stop
            ends = [minimise_flip(judge, picture, x, *self.box, on_value=told, should_stop=stop) for x in starts]
            stage.vector = min(ends, key=lambda end: end[1])[0]
        return [x for x, _ in ends]


def _random_start(lower: Vector, upper: Vector, seed: int) -> Vector:
    return lower + (upper - lower) * np.random.default_rng(seed).uniform(0.1, 0.9, len(lower))
