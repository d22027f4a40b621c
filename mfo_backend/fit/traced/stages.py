# SPDX-License-Identifier: Apache-2.0
"""The stages of a fit on traced paths: a scan, a race of the best nodes, a polish on pooled samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...solve.bounded_least_squares import NormalEquations
from ...solve.noisy_least_squares import cautious_step
from ...types.image import Pixels
from ..alike.unneeded_lobes import values_off
from ..plans import TransmissionPlan
from ..random_streams import Stream
from ..result.course import Course, Stage
from .choose_end import GUARD_PARTS, choose_end
from .pictures import GEOMETRIC, SECANT_BELOW, TracedTiles, is_unsure, two_half_equations
from .polished import AMOUNTS, CORE, Polished, without_lobe
from .sample_count import MOST_COUNT, Recount
from .sample_pools import TilePools

if TYPE_CHECKING:  # the module needs Mitsuba's variant to be set
    from ...render.paths.traced_paths import TracedPaths

Vector = NDArray[np.float64]

ROUGHNESS_NODES = (0.05, 0.12, 0.22, 0.35, 0.55, 0.85)
IOR_NODES = (1.1, 1.25, 1.4, 1.55, 1.75, 2.1)
COAT_NODES = (0.1, 0.3, 0.6)  # roughness, besides the scene's
COAT = 0.3  # weight they start from
SURELY_OFF = 0.05  # of the range: standard deviation of an amount that can be told from none
TILE_SIZES = (1, 2, 4, 8)
DIFFERENT = 0.12  # of the range, in any value: points that are worth to be followed both
SETTLED = 2  # times in a row that the expected error has to be small: it is an estimate itself
LEAST_STEPS = 4  # two steps alone once looked settled with a value off by a tenth of its range
MOST_SAMPLES = 16  # of a pixel in a step of the polish
GROWTH = 4  # of a step's samples, at most
OWN = 0.25  # of the expected error: below, more samples help little
FEW_STEPS = 4  # before, the error is that of few samples everywhere
FAR = {True: 0.015, False: 0.06}  # of the range, of sharp materials and others: samples from so far away count half
TRUST = 0.25  # of the range: the longest step
MOST_COUNTINGS = 3  # of the reference's samples
COUNTED_STEPS = 3  # between them
STILL = 0.25  # relative change of a count
RIVALS = 3  # other ends of a race


@dataclass
class Runner:
    """A point of the race with the equations there."""

    x: Vector
    equations: NormalEquations | None = None
    damping: float = 0.01


class TransmissionFit:
    """The stages of one fit; `reference` is scene-linear, `mask` holds the pixels to look at."""

    def __init__(
        self,
        paths: TracedPaths,
        start: Vector,
        reference: Pixels,
        mask: NDArray[np.bool_],
        plan: TransmissionPlan,
        seed: int,
        course: Course,
        clipped: NDArray[np.float32] | None = None,
    ) -> None:
        self.paths, self.start, self.mask = paths, start, mask
        self.plan, self.seed, self.course = plan, seed, course
        self.table = paths.table
        self.pictures = TracedTiles(paths, reference, mask, clipped, course.should_stop)
        self.rivals: list[Vector] = []  # other ends of the race
        self._width = self.table.upper - self.table.lower
        # values besides those of the glass stay as in the scene until the polish; without glass none does
        self._extras = ~self.table.mask_of(CORE if "transmission_weight" in self.table.names else self.table.names)

    def scan(self) -> list[tuple[float, Vector]]:
        """Stage `scan`: all nodes of roughness and index with the best other values, best first."""
        plan, table = self.plan, self.table
        with self.course.stage("scan") as stage:
            tiles = self.pictures.tiles(4, plan.scan_pixels)
            nodes = {"roughness": ROUGHNESS_NODES, "ior": IOR_NODES}
            held = [name for name in GEOMETRIC if name in table.names]
            middle = self.start.copy()
            for name in ("base_color", "transmission_weight"):
                if name in table.names:
                    part = table.slice_of(name)
                    middle[part] = table.lower[part] + 0.75 * self._width[part]
            xs = []
            for values in product(*(nodes[name] for name in held)):
                x = middle.copy()
                for name, value in zip(held, values, strict=True):
                    x[table.slice_of(name)] = value
                xs.append(x)
            xs = table.clip(np.array(xs))
            frozen = self._extras | table.mask_of(held)
            equations: list[NormalEquations] = []
            order = np.arange(len(xs))
            for turn in range(plan.scan_steps + 1):
                rows = self.pictures.halves(
                    tiles, xs, seed=Stream.SCAN.seed(self.seed), samples=plan.scan_samples, moving=False
                )
                equations = [two_half_equations(*pair) for pair in rows]
                order = np.argsort([e.cost for e in equations])
                self._note(stage, xs[order[0]], equations[order[0]].cost)
                if turn == plan.scan_steps or frozen.all() or self.course.should_stop():
                    break
                # the better half goes on
                order = order[: -(-len(order) // 2)]
                xs = np.array([xs[i] + self._step(equations[i], xs[i], 0.02, 0.5, frozen) for i in order])
            stage.vector = xs[order[0]]
            return [(equations[i].cost, xs[i]) for i in order]

    def race(self, nodes: list[tuple[float, Vector]]) -> Vector:
        """Stage `race`: damped steps from the best different nodes and the scene's material, all in one launch."""
        plan = self.plan
        with self.course.stage("race") as stage:
            tiles = self.pictures.tiles(4, plan.race_pixels)
            few = len(tiles.pixels) < self.mask.sum()
            runners = [Runner(x.copy()) for x in self._different([x for _, x in nodes], plan.starts)]
            runners.append(Runner(self.table.clip(self.start)))
            best, cost = runners[0], np.inf
            for turn in range(plan.race_steps + 1):
                trials = [r.x if r.equations is None else r.x + self._damped(r) for r in runners]
                rows = self.pictures.halves(
                    tiles, np.array(trials), seed=Stream.RACE.seed(self.seed), samples=plan.race_samples
                )
                if self.course.should_stop():
                    break
                if few and turn == 0 and is_unsure(*rows[0]):
                    tiles = self.pictures.tiles(4, 2 * plan.race_pixels)
                    rows = self.pictures.halves(
                        tiles, np.array(trials), seed=Stream.RACE_MORE_PIXELS.seed(self.seed), samples=plan.race_samples
                    )
                for runner, trial, pair in zip(runners, trials, rows, strict=True):
                    self._accept(runner, trial, two_half_equations(*pair))
                runners.sort(key=lambda r: r.equations.cost if r.equations else np.inf)
                best = runners[0]
                stage.vector = best.x
                assert best.equations is not None
                self._note(stage, best.x, best.equations.cost)
                gained = best.equations.cost < 0.8 * cost
                cost = best.equations.cost
                if turn >= 2:
                    if not gained:
                        break
                    runners = self._leaders(runners)
            found = [best.x, *(runner.x for runner in runners), *(x for _, x in nodes)]
            self.rivals = self._different(found, 1 + RIVALS)[1:]
            return best.x

    def _leaders(self, runners: list[Runner]) -> list[Runner]:
        """Those of the sorted runners that have not fallen behind and are not where a better one is."""
        leader = runners[0].equations
        assert leader is not None
        kept: list[Runner] = []
        for r in runners:
            behind = r.equations is None or r.equations.cost > leader.cost + 2.0 * abs(leader.cost)
            if not behind and all(np.max(np.abs(r.x - k.x) / self._width) > DIFFERENT for k in kept):
                kept.append(r)
        return kept[:2]

    def _damped(self, runner: Runner) -> Vector:
        assert runner.equations is not None
        return self._step(runner.equations, runner.x, runner.damping, TRUST, self._extras)

    def _accept(self, runner: Runner, x: Vector, equations: NormalEquations) -> None:
        if not equations.finite:
            runner.damping *= 10.0
        elif runner.equations is None or equations.cost < runner.equations.cost:
            runner.x, runner.equations = x, equations
            runner.damping = max(runner.damping / 3.0, 1e-3)
        else:
            runner.damping = max(runner.damping * 6.0, 0.05)

    def polish(self, start: Vector) -> list[Polished]:
        """Stage `polish`: Gauss-Newton steps on all samples so far, each with new random numbers.

        Where lobes are free, the first end has their details as in the scene; another has all values free but those of
        lobes that the first did not need. Where the picture does not determine some of these or does not need some
        lobes, an end with those as in the scene follows, and one more where that leaves further values without effect.
        """
        with self.course.stage("polish") as stage:
            x, user, ends = self._counted(stage, start), self.table.clip(self.start), []
            off = useless = np.zeros(self.table.length, bool)
            if self._extras.any():
                x = self._pool(stage, x, self._extras, Stream.POLISH_GLASS).x
                amounts = self.table.mask_of(AMOUNTS)
                details = self._extras & ~amounts
                if amounts.any() and details.any():
                    # how much there is of a lobe before its details: together they may trade places with the glass
                    x = self._coated(stage, x)
                    ends.append(replace(self._pool(stage, x, details, Stream.POLISH_LOBES), unseen=details))
                    off = ends[-1].unneeded(self.table, user, useless, SURELY_OFF)
                    useless = without_lobe(off, self.table, user)
                    x = np.where(off, user, ends[-1].x)
            ends.append(replace(self._pool(stage, x, off | useless, Stream.POLISH), unseen=useless))
            for stream in (Stream.POLISH_RETURNED, Stream.POLISH_RETURNED_AGAIN):
                last = ends[-1]
                unseen = last.undetermined(self.table, user)
                unneeded = last.unneeded(self.table, user, unseen)
                unseen |= without_lobe(last.kept | unseen | unneeded, self.table, user)
                kept = last.kept | unseen | unneeded
                if not np.any(unseen | unneeded) or kept.all() or self.course.should_stop():
                    break
                end = self._pool(stage, np.where(kept, user, last.x), kept, stream)
                ends.append(replace(end, unseen=last.unseen | unseen))
            stage.vector = ends[-1].x
        return ends

    def _coated(self, stage: Stage, x: Vector) -> Vector:
        """The point with the coat that explains most, of one roughness each, where the scene's material has none.

        Its roughness is nobody's choice then, and from a sharp coat a polish finds no way to a rough one. Nor does a
        glass that has taken a coat's reflections for those of a higher index find back.
        """
        plan, table, lobe = self.plan, self.table, ("coat_weight", "coat_roughness")
        if not set(lobe) <= set(table.names) or lobe[0] not in values_off(table, table.clip(self.start)):
            return x
        weight, roughness = (table.slice_of(name) for name in lobe)
        xs = np.tile(x, (1 + len(COAT_NODES), 1))
        xs[1:, roughness] = np.reshape(COAT_NODES, (-1, 1))
        xs[:, weight] = COAT
        frozen = self._extras & ~table.mask_of(lobe[:1])
        tiles, best = self.pictures.tiles(4, plan.coat_pixels), x
        for _ in range(plan.scan_steps + 1):
            rows = self.pictures.halves(tiles, xs, seed=Stream.COAT.seed(self.seed), samples=plan.race_samples)
            if self.course.should_stop():
                return x
            equations = [two_half_equations(*pair) for pair in rows]
            best = xs[int(np.argmin([e.cost for e in equations]))]
            xs = np.array([y + self._step(e, y, 0.02, 0.25, frozen) for e, y in zip(equations, xs, strict=True)])
        return best

    def _counted(self, stage: Stage, x: Vector) -> Vector:
        """Find out how noisy the reference is and so how it is compared from now on; returns a point nearer to it.

        Far from the solution the count is too low, so it is taken again after a few steps until it holds still. The
        race compared plain squares, so its other ends get as many steps at first.
        """
        count, few = 0, self.plan.counted_paths // 4
        for turn in range(MOST_COUNTINGS):
            most = (4 * few if turn else few) // MOST_COUNT
            counts = self.pictures.count_samples(x, most, Stream.COUNT.seed(self.seed, 100 * turn))
            if counts is None or abs(counts.count - count) <= STILL * count or self.course.should_stop():
                break
            count = counts.count
            starts = [x] if turn else [x, *self.rivals]
            ends = [
                self._pool(
                    stage, start, self._extras, Stream.POLISH_COUNTED, 10 * turn, steps=COUNTED_STEPS, paths=few
                ).x
                for start in starts
            ]
            x = ends[self.choose(ends, Stream.CHOOSE_COUNTED, GUARD_PARTS * turn)]
        return x

    def _pool(
        self,
        stage: Stage,
        start: Vector,
        frozen: NDArray[np.bool_],
        stream: Stream,
        first: int = 0,
        *,
        steps: int | None = None,
        paths: int | None = None,
    ) -> Polished:
        """A polish from `start` with the `frozen` values held; `paths` of a step bound those at equal counts.

        Every step has a number of its own in `stream`, from `first` on.
        """
        plan, counts = self.plan, self.pictures.counts
        x, equations, size = start.copy(), None, 0
        most = plan.polish_pixels
        if counts is not None:
            most = min(most, (paths or plan.counted_paths) // counts.count)
        pools = TilePools.of((self.pictures.tiles(size, most) for size in TILE_SIZES), 1 + self.table.length)
        # few pixels need more paths each: products of two noisy numbers average slowly
        samples = int(np.clip(plan.polish_paths // len(pools.pixels), 2, MOST_SAMPLES))
        most = min(GROWTH * samples, MOST_SAMPLES)
        unseen = plan.unseen**2
        if counts is not None:
            samples = most = counts.count
            unseen /= counts.mean_noise  # differences count in deviations of the noise
        moved, settled = 0.0, 0
        for turn in range(steps or plan.polish_steps):
            (table,) = self.pictures.tables(pools.pixels, x[None], stream.seed(self.seed, first + turn), samples)
            if self.course.should_stop():
                break
            table[..., 1:][..., frozen] = 0.0
            far = FAR[self.paths.roughness(x) < SECANT_BELOW]
            pools.fade(1.0 / (1.0 + (moved / far) ** 2))
            pools.add(np.split(table, 2), samples)
            equations, noise, size = pools.best(self._width)
            self._note(stage, x, equations.cost)
            step = self._step(equations, x, 1e-3, 0.1, frozen, noise)
            moved = self._moved(step)
            x = x + step
            pools.shifted(step)
            stage.vector = x
            error = pools.expected_error(equations, noise, size, self._width)
            near = moved <= far and error.total < plan.enough * error.there
            if error.total > unseen and error.own >= OWN * error.total:
                near = False
                if turn >= FEW_STEPS:
                    samples = min(2 * samples, most)
            settled = settled + 1 if near else 0
            if settled >= SETTLED and turn + 1 >= LEAST_STEPS:
                break
        none = np.zeros_like(frozen)
        if equations is None:
            unknown = np.diag(self._width**2)
            return Polished(x, unknown, frozen, none, None, unknown)
        if pools.are_many and not self.course.should_stop():
            # cautious steps end up to a deviation short of what all samples together say
            equations, _, size = pools.best(self._width)
            x = x + self._step(equations, x, 1e-3, 0.1, frozen)
            stage.vector = x
        covariance, noise = pools.covariance(equations, size, self._width)
        again = self._recount(x, pools, stream) if steps is None else None
        if again is not None and not self.course.should_stop():
            away = pools.answer(again.slope, equations, size, self._width)
            x = self.table.clip(x + again.log_ratio * away)
            covariance = covariance + again.sd**2 * np.outer(away, away)
            stage.vector = x
        return Polished(x, covariance, frozen, none, equations, noise)

    def _moved(self, step: Vector) -> float:
        """How far a step goes, in parts of the range, in what moves the paths; all else is nearly linear."""
        parts = [self.table.slice_of(name) for name in GEOMETRIC if name in self.table.names]
        return max((float(np.max(np.abs(step[part]) / self._width[part])) for part in parts), default=0.0)

    def choose(self, candidates: list[Vector], stream: Stream = Stream.CHOOSE, first: int = 0) -> int:
        """See `choose_end`."""
        return choose_end(self.pictures, candidates, self.plan, self.seed, stream, first)

    def _step(
        self,
        equations: NormalEquations,
        x: Vector,
        damping: float,
        trust: float,
        frozen: NDArray[np.bool_] | None = None,
        noise: Vector | None = None,
    ) -> Vector:
        reach = trust * self._width
        lower, upper = np.maximum(self.table.lower - x, -reach), np.minimum(self.table.upper - x, reach)
        if frozen is not None:
            lower, upper = np.where(frozen, 0.0, lower), np.where(frozen, 0.0, upper)
        return cautious_step(equations, np.minimum(lower, 0.0), np.maximum(upper, 0.0), self._width, damping, noise)

    def _different(self, points: list[Vector], count: int) -> list[Vector]:
        chosen: list[Vector] = []
        for x in points:
            if all(np.max(np.abs(x - other) / self._width) > DIFFERENT for other in chosen):
                chosen.append(x)
            if len(chosen) == count:
                break
        return chosen

    def _recount(self, x: Vector, pools: TilePools, stream: Stream) -> Recount | None:
        seed = Stream.RECOUNT.seed(self.seed, stream.value.first)
        return self.pictures.recount(x, pools.pixels, seed)

    def _note(self, stage: Stage, x: Vector, cost: float) -> None:
        self.course.reached(stage, x, float(np.sqrt(max(2.0 * cost, 0.0))))
