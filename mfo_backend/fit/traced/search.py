# SPDX-License-Identifier: Apache-2.0
"""Where a fit on traced paths begins: a scan of nodes, then a race of the best of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...render.camera.primary_rays import TILE
from ...solve.bounded_least_squares import NormalEquations
from ...solve.noisy_least_squares import cautious_step
from ...types.parameter import ParameterTable, Vector
from ..plans import TransmissionPlan
from ..random_streams import Stream
from ..result.course import Course, Stage
from ..search.race_starts import different, is_new
from .pictures import GEOMETRIC, TracedTiles, is_unsure, two_half_equations
from .polished import CORE

TRACED_ROUGHNESS_NODES = (0.05, 0.12, 0.22, 0.35, 0.55, 0.85)
IOR_NODES = (1.1, 1.25, 1.4, 1.55, 1.75, 2.1)
TRUST = 0.25  # of the range: the longest step
SCAN_DAMPING, SCAN_TRUST = 0.02, 0.5  # of the curvature, added to it; a node's longest step. No measurement
MIDDLE = 0.75  # of the range: colour and transmission that a node starts with, for most glass is clear. No measurement
GAINED = 0.8  # of the cost before: a turn of a race that leaves more has gained nothing. No measurement
BEHIND = 2.0  # times the leader's cost above it: a runner there is given up. No measurement
RIVALS = 3  # other ends of a race


@dataclass(frozen=True, eq=False)
class Setting:
    """What all stages of a traced fit stand on; `start` is the scene's material, inside the bounds or not."""

    pictures: TracedTiles = field(repr=False)
    start: Vector
    plan: TransmissionPlan
    seed: int
    course: Course

    @property
    def table(self) -> ParameterTable:
        """The values that are fitted."""
        return self.pictures.paths.table

    @property
    def extras(self) -> NDArray[np.bool_]:
        """Values besides the glass' own, which stay as in the scene until the polish; without glass none does."""
        names = self.table.names
        return ~self.table.mask_of(CORE if "transmission_weight" in names else names)

    def step(
        self,
        equations: NormalEquations,
        x: Vector,
        damping: float,
        trust: float,
        frozen: NDArray[np.bool_],
        noise: Vector | None = None,
    ) -> Vector:
        """A step inside the bounds and no longer than `trust` of the range; the `frozen` values stay."""
        reach = trust * self.table.width
        lower, upper = np.maximum(self.table.lower - x, -reach), np.minimum(self.table.upper - x, reach)
        lower, upper = np.where(frozen, 0.0, lower), np.where(frozen, 0.0, upper)
        box = np.minimum(lower, 0.0), np.maximum(upper, 0.0)
        return cautious_step(equations, *box, self.table.width, damping, noise)

    def note(self, stage: Stage, x: Vector, cost: float) -> None:
        """Report a point with the root mean square of its residual."""
        self.course.note(stage, x, float(np.sqrt(max(2.0 * cost, 0.0))), best=True)


def scan(setting: Setting) -> list[Vector]:
    """Stage `scan`: all nodes of roughness and index with the best other values, best first."""
    plan, table, pictures = setting.plan, setting.table, setting.pictures
    with setting.course.stage("scan") as stage:
        tiles = pictures.tiles(TILE, plan.scan_pixels)
        nodes = {"roughness": TRACED_ROUGHNESS_NODES, "ior": IOR_NODES}
        held = [name for name in GEOMETRIC if name in table.names]
        middle = setting.start.copy()
        for name in ("base_color", "transmission_weight"):
            if name in table.names:
                part = table.slice_of(name)
                middle[part] = table.lower[part] + MIDDLE * setting.table.width[part]
        xs = []
        for values in product(*(nodes[name] for name in held)):
            x = middle.copy()
            for name, value in zip(held, values, strict=True):
                x[table.slice_of(name)] = value
            xs.append(x)
        xs = table.clip(np.array(xs))
        frozen = setting.extras | table.mask_of(held)
        order = np.arange(len(xs))
        for turn in range(plan.scan_steps + 1):
            rows = pictures.halves(
                tiles, xs, seed=Stream.SCAN.seed(setting.seed), samples=plan.scan_samples, moving=False
            )
            equations = [two_half_equations(*pair) for pair in rows]
            order = np.argsort([e.cost for e in equations])
            setting.note(stage, xs[order[0]], equations[order[0]].cost)
            if turn == plan.scan_steps or frozen.all() or setting.course.should_stop():
                break
            # the better half goes on
            order = order[: -(-len(order) // 2)]
            xs = np.array([xs[i] + setting.step(equations[i], xs[i], SCAN_DAMPING, SCAN_TRUST, frozen) for i in order])
        stage.vector = xs[order[0]]
        return [xs[i] for i in order]


@dataclass(frozen=True)
class Runner:
    """A point of the race with the equations there, once it has any."""

    x: Vector
    equations: NormalEquations | None = None
    damping: float = 0.01

    @property
    def cost(self) -> float:
        """Infinite before the first equations."""
        return np.inf if self.equations is None else self.equations.cost

    def trial(self, setting: Setting) -> Vector:
        """Where it looks next."""
        if self.equations is None:
            return self.x
        return self.x + setting.step(self.equations, self.x, self.damping, TRUST, setting.extras)

    def after(self, x: Vector, equations: NormalEquations) -> Runner:
        """At the trial `x` if that is better, else more cautious."""
        if not equations.finite:
            return replace(self, damping=10.0 * self.damping)
        if equations.cost < self.cost:
            return Runner(x, equations, max(self.damping / 3.0, 1e-3))
        return replace(self, damping=max(self.damping * 6.0, 0.05))


def race(setting: Setting, nodes: Sequence[Vector]) -> list[Vector]:
    """Stage `race`: damped steps from the best different nodes and the scene's material, all in one launch.

    Returns the best end and up to `RIVALS` others that differ from it.
    """
    plan, pictures, stopped = setting.plan, setting.pictures, setting.course.should_stop
    with setting.course.stage("race") as stage:
        tiles = pictures.tiles(TILE, plan.race_pixels)
        few = len(tiles.pixels) < pictures.mask.sum()
        table = setting.table
        runners = [Runner(x) for x in (*different(nodes, table, plan.starts), table.clip(setting.start))]
        best, cost = runners[0], np.inf
        for turn in range(plan.race_steps + 1):
            trials = np.array([runner.trial(setting) for runner in runners])
            rows = pictures.halves(tiles, trials, seed=Stream.RACE.seed(setting.seed), samples=plan.race_samples)
            if stopped():
                break
            if few and turn == 0 and is_unsure(*rows[0]):
                tiles = pictures.tiles(TILE, 2 * plan.race_pixels)
                seed = Stream.RACE_MORE_PIXELS.seed(setting.seed)
                rows = pictures.halves(tiles, trials, seed=seed, samples=plan.race_samples)
            runners = [
                runner.after(trial, two_half_equations(*pair))
                for runner, trial, pair in zip(runners, trials, rows, strict=True)
            ]
            runners.sort(key=lambda runner: runner.cost)
            best = runners[0]
            stage.vector = best.x
            setting.note(stage, best.x, best.cost)
            gained = best.cost < GAINED * cost
            cost = best.cost
            if turn >= 2:
                if not gained:
                    break
                runners = _leaders(setting, runners)
        return different([best.x, *(runner.x for runner in runners), *nodes], table, 1 + RIVALS)


def _leaders(setting: Setting, runners: Sequence[Runner]) -> list[Runner]:
    """Those of the sorted runners that have not fallen behind and are not where a better one is."""
    leader, kept = runners[0].cost, list[Runner]()
    for runner in runners:
        if runner.cost <= leader + BEHIND * abs(leader) and is_new(runner.x, [each.x for each in kept], setting.table):
            kept.append(runner)
    return kept[:2]
