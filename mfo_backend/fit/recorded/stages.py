# SPDX-License-Identifier: Apache-2.0
"""The stages of the presets `fast`, `balanced` and `best`, from a scan to FLIP."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...render.primary_rays import TILE
from ...render.recorded_image import RECALLED, RecordedImage
from ...render.recorded_paths import LaneGroups, RecordedPaths
from ...render.recorded_scene import MOST_LANES, RecordedScene
from ...solve.bounded_least_squares import NormalEquations, Solution, SolveLimits, solve_bounded
from ...types.errors import UnrecordableError
from ...types.image import Pixels
from ..alike.exchanges import best_basin, metal_rivals
from ..alike.simplest import OtherEnds, SimplestEnd
from ..alike.unneeded_lobes import Box, solve_without_unneeded
from ..alike.width_rivals import width_rivals
from ..plans import RecordedPlan
from ..result.course import Course, Stage
from ..search.global_start import ROUGHER_WIDTH, agreeing_ends, best_starts, random_start, scan
from ..search.race_starts import CLEARLY_LOWER, race
from ..squares.problem import Problem, Refined
from ..squares.residuals import MakeResidual, MakeWeighted, OneSidedResidual, WeightedResidual
from .finer_grid import finer_grid
from .fireflies import without_fireflies
from .reference_noise import TileNoise, tile_noise
from .where_to_look import all_groups, detail_grid, edges_of_light, fewer_groups, solution_grid, thinned_grid

Vector = NDArray[np.float64]

# Share of the radiance that no weight looks below: float32, quantisation, small differences of renderers
LEAST_NOISE = 0.002
SPARE = 1.5  # times the lanes a start is found on are recorded for it: its tiles are chosen by what they show
MOST_RECORDINGS = 3  # at the solution, until it holds still
# After a solve its recording is too old if the tiles changed by this share, or if its own noise grew by this factor.
# The first is what mends fits that began far away, though most of those keep their samples; the second finds a lobe
# that became narrow in few tiles.
MOVED = 0.15
NOISIER = 1.25
SAMPLES = 2  # of the light in a recording at the solution: their difference shows the recording's own noise
COST_CHANGE = 1e-5  # relative, of a step that ends a solve
# The same where there is noise, as a part of what one value explains of pure noise (chi squared)
NOT_SEEN = 0.3
COST_FLOOR = 1e-11  # a relative error of 5e-6 a pixel: below it float32 leaves nothing to gain


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
        self._tiles: dict[LaneGroups, RecordedImage] = {}
        self._pictures: RecordedImage | None = None
        self.noise: TileNoise | None = None  # of the reference, known after `refine` or `misfit`
        self.table = scene.renderer.table
        self.recordings = 0
        self._edges: NDArray[np.bool_] | None = None  # of light, where the fit looks at the silhouette
        self._thinned = False  # whether the present recording leaves pixels out that no stage has needed so far
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
        self.record_whole(x)
        return self.shown(self._pixels(x))

    def shown(self, pixels: NDArray[np.float32]) -> Pixels:
        """The picture that these covered pixels are part of, which is the reference elsewhere."""
        image = self.reference.astype(np.float32).copy()
        image.reshape(-1, 3)[self.paths.pixel] = pixels
        return image

    def problem(
        self, groups: LaneGroups, make: MakeResidual, *, calm: bool = False, near: Vector | None = None
    ) -> Problem:
        """The residuals of these groups of the present recording, to the reference or to it without fireflies."""
        residual = make(groups.average(self.calm if calm else self.reference))
        if self.clipped is not None:
            residual = OneSidedResidual(residual, groups.average(self.clipped) > 0)
        return Problem(self._evaluator(groups), residual, groups, near)

    def tiles(self, side: int) -> LaneGroups:
        """All tiles of this side of the present recording; their evaluations are remembered between problems."""
        if side not in self._groups:
            groups = all_groups(self.paths, side)
            self._groups[side] = groups
            self._tiles[groups] = self.scene.evaluator(self.paths, groups, RECALLED)
        return self._groups[side]

    def _evaluator(self, groups: LaneGroups) -> RecordedImage:
        return self._tiles[groups] if groups in self._tiles else self.scene.evaluator(self.paths, groups, RECALLED)

    def start_from_nothing(self, make: MakeResidual) -> list[Solution]:
        """Stages `scan` and `start`: solutions from the scan's nodes, the scene's material and a random one.

        The best one comes first; the others are different and cost little more.
        """
        plan, renderer = self.plan, self.scene.renderer
        sampled = self.scene.needs.sampled
        with self.course.stage("scan") as stage:
            grid = plan.grid_first
            if not sampled:  # only the pixel's footprint is
                grid = detail_grid(self.reference, self.mask)
                grid = thinned_grid(grid, self.reference, self.mask, plan.refine_lanes)
                self._thinned = not (grid[self.mask] > 0).all()
            if self._thinned:
                self.course.picture = None
            enough = SPARE * plan.start_lanes if sampled else MOST_LANES
            self.paths = self.scene.record(renderer.start, grid=grid, seed=self.seed, near=False, enough=enough)
            groups = all_groups(self.paths, TILE) if sampled else all_groups(self.paths, 1, self.reference)
            if not (sampled or self._thinned):
                self._edges = edges_of_light(self.paths, groups)
            if self._edges is not None:
                self._record(renderer.start, detail_grid(self.reference, self.mask, self._edges), near=False)
                groups = all_groups(self.paths, 1, self.reference)
            lanes = plan.scan_lanes if sampled else plan.exact_scan_lanes
            few = self.problem(fewer_groups(groups, self.reference, lanes), make, calm=True)
            starts = []
            if plan.same_cost:
                evaluations = plan.agreement_evaluations if sampled else plan.exact_agreement_evaluations
                exact = {} if sampled else {"metal_width": ROUGHER_WIDTH, "most": 0.5 * plan.seen_rms**2}
                starts = agreeing_ends(
                    lambda start: self._solve(few, start, evaluations, stage=stage),
                    self.table, self.scene.model.scanned, plan.same_cost, **exact,
                )  # fmt: skip
            if not starts and plan.scan:
                nodes = scan(self.course.watch(stage, few.equations), self.table, self.scene.model.scanned)
                starts = best_starts(nodes, plan.starts)
            stage.vector = starts[0] if starts else None
        with self.course.stage("start") as stage:
            lanes = plan.start_lanes if sampled else plan.exact_start_lanes
            more = self.problem(fewer_groups(groups, self.reference, lanes), make, calm=True)
            starts += [renderer.start, random_start(self.table, self.seed)]
            basins = self._race(stage, more, starts)
            if not np.isfinite(basins[0].equations.cost):
                raise UnrecordableError("No start of the fit gives finite numbers on the recorded light paths.")
            stage.vector = basins[0].x
        return basins

    def _race(self, stage: Stage, problem: Problem, starts: list[Vector]) -> list[Solution]:
        def solve(start: Vector, evaluations: int, known: float) -> Solution:
            return self._solve(problem, start, evaluations, stage=stage, known=known)

        return race(solve, starts, self.table.upper - self.table.lower, self.plan, self.course.should_stop)

    def _solve(
        self,
        problem: Problem,
        start: Vector,
        evaluations: int,
        *,
        stage: Stage | None = None,
        box: Box | None = None,
        known: float = 0.0,
        wanted: float | None = None,
    ) -> Solution:
        """A bounded solve whose evaluations are noted in `stage`; any other solution is better than one not finite.

        With the cost of a `known` solution it ends where it is nearly as good and promises nothing clearly better; with
        a `wanted` cost, where it promises no less than that.
        """
        below, wanted = (self.plan.basin_factor * known, CLEARLY_LOWER * known) if wanted is None else (np.inf, wanted)
        limits = replace(self._limits(problem, evaluations), known=below, wanted=wanted)
        lower, upper = box or (self.table.lower, self.table.upper)
        equations = problem.equations if stage is None else self.course.watch(stage, problem.equations)
        try:
            return solve_bounded(equations, start, lower, upper, limits, self.course.should_stop)
        except ValueError:
            nothing = np.zeros(len(start))
            return Solution(start, NormalEquations(np.inf, nothing, np.diag(nothing)), (np.inf,), True)

    def solve_within(
        self, problem: Problem, start: Vector, lower: Vector, upper: Vector, *, wanted: float = np.inf
    ) -> Vector:
        """A few steps with other bounds from another solution, given up where they promise no less than `wanted`."""
        return self._solve(problem, start, 8, box=(lower, upper), wanted=wanted).x

    def _limits(self, problem: Problem, evaluations: int) -> SolveLimits:
        """Limits of a solve, which ends where there is noise at the change that it explains by itself."""
        noise = NOT_SEEN / problem.independent if self.scene.needs.sampled else 0.0
        unseen = 0.0 if problem.near is None else noise  # the search for a start has few and large tiles
        change = max(COST_CHANGE, noise)
        return SolveLimits(evaluations=evaluations, cost_change=change, cost_floor=COST_FLOOR, unseen=unseen)

    def _rival(self, problem: Problem, found: Vector, others: Sequence[Vector]) -> Vector | None:
        """The best of the other basins on the same problem, if it is clearly better."""
        if not others or self.course.should_stop():
            return None
        # a solve that ended for want of evaluations has more to gain than its quadratic says
        known = self._solve(problem, found, self.plan.trial_evaluations).equations.cost
        rivals = (self._solve(problem, x, self.plan.trial_evaluations, known=known) for x in others)
        best = min(rivals, key=lambda rival: rival.equations.cost)
        return best.x if best.equations.cost < CLEARLY_LOWER * known else None

    def refine(
        self, start: Vector, make: MakeResidual, weigh: MakeWeighted | None, others: Sequence[Vector] = ()
    ) -> Refined:
        """Stage `refine`: all residuals, on a new and finer recording near the solution where the light is sampled.

        There, residuals count in standard deviations of the reference's noise by `weigh` if given, and solutions in
        other basins (`others`) are tried: they may have cost more by the noise of the first recording alone.
        """
        with self.course.stage("refine") as stage:
            if self.scene.needs.sampled:
                refined = self._refine_sampled(stage, start, make, weigh, others)
            else:
                refined = self._refine_exact(stage, start, make)
            stage.vector = refined.x
        if self.scene.model.limited_width:
            refined = replace(refined, rivals=(*refined.rivals, *width_rivals(refined.all, refined.x, self.table)))
        return refined

    def _refine_exact(self, stage: Stage, start: Vector, make: MakeResidual) -> Refined:
        grid = None
        if not self._thinned:
            grid = solution_grid(self.reference, self.mask, lambda: self.picture(start), self._edges)
        if grid is not None:
            self._record(start, grid)
        groups = all_groups(self.paths, 1, self.reference)
        groups = fewer_groups(groups, self.reference, self.plan.refine_lanes)
        problem = self.problem(groups, make)

        def solve_below(x: Vector, wanted: float) -> Solution:
            return self._solve(problem, x, self.plan.other_evaluations, stage=stage, wanted=wanted)

        found = best_basin(solve_below, self._solve(problem, start, 15, stage=stage), self.table)
        found, rivals = metal_rivals(problem, solve_below, found, self.table)
        return Refined(found.x, problem, problem, rivals=rivals)

    def _refine_sampled(
        self,
        stage: Stage,
        start: Vector,
        make: MakeResidual,
        weigh: MakeWeighted | None,
        others: Sequence[Vector],
    ) -> Refined:
        x, grid = self._recorded_near(stage, start, make, weigh)
        stage.vector = x
        # the first weights came from a model that was still off
        refined = self._problems(x, make, weigh, solve_all=True)
        rival = self._rival(refined.few, x, others)
        if rival is not None:
            known = refined.few.equations(x).cost
            del refined  # and with it the recording
            better, _ = self._recorded_near(stage, rival, make, weigh)
            refined = self._problems(better, make, weigh, solve_all=True)
            if refined.few.equations(better).cost < known:
                x = better
            else:  # what had made it look better was the noise of a recording for another material
                del refined
                self._record(x, grid)
                refined = self._problems(x, make, weigh, solve_all=True)
        return self._last_steps(stage, replace(refined, x=x), weighted=weigh is not None)

    def _last_steps(self, stage: Stage, refined: Refined, *, weighted: bool) -> Refined:
        """The solution on all tiles; where residuals are in deviations of the noise, without lobes nobody asks for."""
        x, problem = refined.x, refined.all
        if not weighted:
            return replace(refined, x=self._solve(problem, x, 12, stage=stage).x)
        user = self.scene.renderer.start
        found, off = solve_without_unneeded(
            lambda start, box: self._solve(problem, start, 12, stage=stage, box=box),
            problem.equations(x), problem.independent, x, user, self.table,
        )  # fmt: skip
        others = OtherEnds(refined, partial(self._solve, stage=stage), user, self.table)
        last = others.simplest(SimplestEnd(found, off))
        return replace(refined, x=last.end.x, off=last.off, rivals=last.rivals)

    def _recorded_near(
        self, stage: Stage, start: Vector, make: MakeResidual, weigh: MakeWeighted | None
    ) -> tuple[Vector, int]:
        """The solution on some tiles of a recording, made anew until it is near the material that was recorded, and
        the grid of the last one."""
        grid, most = self.plan.grid_last, self.recordings + MOST_RECORDINGS
        while True:
            self._record(start, grid)
            few = self._problems(start, make, weigh).few
            x = self._solve(few, start, 12, stage=stage).x
            before, after = few.own_noise(start), few.own_noise(x)
            moved = few.change(start, x) > MOVED or after > NOISIER * before
            finest = partial(self.scene.finest_grid, SAMPLES)
            finer = finer_grid(grid, after, few.own_share(x), self.plan, finest)
            if not (moved or finer > grid) or self.recordings == most or self.course.should_stop():
                return x, grid
            del few  # and with it the recording
            start, grid = x, finer

    def _record(self, x: Vector, grid: int | NDArray[np.int64], *, near: bool = True) -> None:
        """Replace the recording by one of `x`; the old one is let go first, for they are what needs the memory."""
        del self.paths
        self._groups, self._tiles, self._pictures = {}, {}, None
        self.recordings += 1
        seed = self.seed + self.recordings
        self.paths = self.scene.record(x, grid=grid, seed=seed, near=near, samples=SAMPLES)

    def record_whole(self, x: Vector) -> None:
        """Record the pixels, too, that the stages until here have left out."""
        if self._thinned:
            self._thinned = False
            self._record(x, detail_grid(self.reference, self.mask), near=False)  # few groups look at it closely
            self.course.picture = self.picture

    def _problems(
        self, x: Vector, make: MakeResidual, weigh: MakeWeighted | None, *, solve_all: bool = False
    ) -> Refined:
        """All tiles of the last stage and some of them; `weigh` weighs by the noise that the model `x` leaves.

        With `solve_all`, the picture for that noise brings all tiles' derivatives at `x`, where their solve begins.
        """
        groups = self.tiles(self.plan.side_last)
        some = np.arange(0, len(groups), max(len(groups) // self.plan.first_tiles, 1))
        weighing = fewer = make
        if weigh is not None:
            pixels = self._pixels_with_tiles(x, groups) if solve_all else self._pixels(x)
            noise = self.noise = tile_noise(
                self.calm, pixels, self.paths, groups, self.paths.interior, self.plan.side_last
            )
            weighing, fewer = (self._weighing(n, groups, weigh) for n in (noise, noise.take(some)))
        problem = self.problem(groups, weighing, near=x)
        few = problem if len(some) == len(groups) else self.problem(groups.take(some), fewer, near=x)
        return Refined(x, problem, few)

    def _pixels(self, x: Vector) -> NDArray[np.float32]:
        """Radiance of the covered pixels, (p, 3)."""
        self._pictures = self._pictures or self.scene.pictures(self.paths, self.paths.pixel_groups())
        return self._pictures(x)[:, :, 0]

    def _pixels_with_tiles(self, x: Vector, groups: LaneGroups) -> NDArray[np.float32]:
        """The same by an evaluation with derivatives, which those of the tiles `groups` are made of."""
        pixels = self.scene.evaluator(self.paths, self.paths.pixel_groups()).samples(x)
        self._tiles[groups].note(x, pixels.averaged(groups.mean_of_pixels))
        return pixels.mean[:, :, 0]

    def misfit(self, x: Vector) -> float:
        """Root mean square difference of the recorded tiles from the reference, in standard deviations of the noise."""
        self.record_whole(x)
        groups, pixels = self.tiles(TILE), self._pixels(x)
        self.noise = tile_noise(self.calm, pixels, self.paths, groups, self.paths.interior, TILE)
        problem = self.problem(groups, self._weighing(self.noise, groups))
        values = problem.residual(groups.mean_of_pixels(pixels))[0]
        # as far as a few outliers go, it is their number that counts and not their size
        return float(np.sqrt(np.mean(np.minimum(np.abs(values), WeightedResidual.LIMIT) ** 2)))

    def _weighing(self, noise: TileNoise, groups: LaneGroups, weigh: MakeWeighted = WeightedResidual) -> MakeResidual:
        least = LEAST_NOISE * float(groups.average(self.reference).mean())
        weight = (1.0 / np.hypot(noise.deviation, max(least, 1e-12))).astype(np.float32)
        return lambda target: weigh(target, weight)

    def polish(self, name: str, problem: Problem, make: MakeResidual, starts: list[Vector]) -> list[Vector] | None:
        """A stage with another residual of the groups of `problem`, from each start; None without finite numbers."""
        with self.course.stage(name) as stage:
            problem = replace(problem, residual=make(problem.groups.average(self.reference)), near=starts[0])
            found = [self._solve(problem, start, 25, stage=stage, box=self.box) for start in starts]
            stage.vector = min(found, key=lambda solution: solution.equations.cost).x
        finite = [solution.x for solution in found if np.isfinite(solution.equations.cost)]
        return finite or None
