# SPDX-License-Identifier: Apache-2.0
"""The polish of a fit on traced paths: Gauss-Newton steps on all samples so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...render.camera.primary_rays import TILE
from ..alike.unneeded_lobes import values_off
from ..random_streams import Stream
from ..result.course import Stage
from .choose_end import GUARD_PARTS, choose_end
from .pictures import GEOMETRIC, SECANT_BELOW, TracedTiles, two_half_equations
from .polished import AMOUNTS, Polished, without_lobe
from .sample_count import MOST_COUNT
from .sample_pools import TilePools
from .search import SCAN_DAMPING, TRUST, Setting, Vector
from .tile_rows import LARGEST_TILE

COAT_NODES = (0.1, 0.3, 0.6)  # roughness, besides the scene's
COAT = 0.3  # weight they start from
# Of the curvature, added to it; of the range, the longest step. No measurement
POLISH_DAMPING, POLISH_TRUST = 1e-3, 0.1
SURELY_OFF = 0.05  # of the range: standard deviation of an amount that can be told from none
TILE_SIZES = (1, 2, 4, LARGEST_TILE)
SETTLED = 2  # times in a row that the expected error has to be small: it is an estimate itself
MOST_SAMPLES = 16  # of a pixel in a step of the polish
GROWTH = 4  # of a step's samples, at most
OWN = 0.25  # of the expected error: below, more samples help little
# Before, the expected error is that of few samples everywhere, and says nothing: two steps alone once looked settled
# with a value off by a tenth of its range
FEW_STEPS = 4
FAR = {True: 0.015, False: 0.06}  # of the range, of sharp materials and others: samples from so far away count half
MOST_COUNTINGS = 3  # of the reference's samples
COUNTED_STEPS = 3  # between them
STILL = 0.25  # relative change of a count


def polish(setting: Setting, raced: Sequence[Vector]) -> tuple[list[Polished], TracedTiles]:
    """Stage `polish`: Gauss-Newton steps from the best end of a race, each with new random numbers.

    Its ends, the last with most values back at the user's, and the pictures they were compared by.
    Where lobes are free, the first end has their details as in the scene; another has all values free but those of
    lobes that the first did not need. Where the picture does not determine some of these or does not need some lobes,
    an end with those as in the scene follows, and one more where that leaves further values without effect.
    """
    table, extras, ends = setting.table, setting.extras, list[Polished]()
    with setting.course.stage("polish") as stage:
        setting, x = _counted(setting, stage, raced)
        user = table.clip(setting.start)
        off = useless = np.zeros(table.length, bool)
        if extras.any():
            x = _pool(setting, stage, x, extras, Stream.POLISH_GLASS).x
            amounts = table.mask_of(AMOUNTS)
            details = extras & ~amounts
            if amounts.any() and details.any():
                # how much there is of a lobe before its details: together they may trade places with the glass
                x = _coated(setting, x)
                ends.append(replace(_pool(setting, stage, x, details, Stream.POLISH_LOBES), unseen=details))
                off = ends[-1].unneeded(table, user, useless, SURELY_OFF)
                useless = without_lobe(off, table, user)
                x = np.where(off, user, ends[-1].x)
        ends.append(replace(_pool(setting, stage, x, off | useless, Stream.POLISH), unseen=useless))
        for stream in (Stream.POLISH_RETURNED, Stream.POLISH_RETURNED_AGAIN):
            last = ends[-1]
            unseen = last.undetermined(table, user)
            unneeded = last.unneeded(table, user, unseen)
            unseen |= without_lobe(last.kept | unseen | unneeded, table, user)
            kept = last.kept | unseen | unneeded
            if not np.any(unseen | unneeded) or kept.all() or setting.course.should_stop():
                break
            end = _pool(setting, stage, np.where(kept, user, last.x), kept, stream)
            ends.append(replace(end, unseen=last.unseen | unseen))
        stage.vector = ends[-1].x
    return ends, setting.pictures


def _coated(setting: Setting, x: Vector) -> Vector:
    """The point with the coat that explains most, of one roughness each, where the scene's material has none.

    Its roughness is nobody's choice then, and from a sharp coat a polish finds no way to a rough one. Nor does a glass
    that has taken a coat's reflections for those of a higher index find back.
    """
    plan, table, lobe = setting.plan, setting.table, ("coat_weight", "coat_roughness")
    if not set(lobe) <= set(table.names) or lobe[0] not in values_off(table, table.clip(setting.start)):
        return x
    weight, roughness = (table.slice_of(name) for name in lobe)
    xs = np.tile(x, (1 + len(COAT_NODES), 1))
    xs[1:, roughness] = np.reshape(COAT_NODES, (-1, 1))
    xs[:, weight] = COAT
    frozen = setting.extras & ~table.mask_of(lobe[:1])
    tiles, best = setting.pictures.tiles(TILE, plan.coat_pixels), x
    for _ in range(plan.scan_steps + 1):
        rows = setting.pictures.halves(tiles, xs, seed=Stream.COAT.seed(setting.seed), samples=plan.race_samples)
        if setting.course.should_stop():
            return x
        equations = [two_half_equations(*pair) for pair in rows]
        best = xs[int(np.argmin([e.cost for e in equations]))]
        xs = np.array([y + setting.step(e, y, SCAN_DAMPING, TRUST, frozen) for e, y in zip(equations, xs, strict=True)])
    return best


def _counted(setting: Setting, stage: Stage, raced: Sequence[Vector]) -> tuple[Setting, Vector]:
    """Find out how noisy the reference is and so how it is compared from now on; a point nearer to it, too.

    Far from the solution the count is too low, so it is taken again after a few steps until it holds still. The race
    compared plain squares, so its other ends get as many steps at first.
    """
    x, count, few = raced[0], 0, setting.plan.counted_paths // 4
    for turn in range(MOST_COUNTINGS):
        most = (4 * few if turn else few) // MOST_COUNT
        pictures = setting.pictures.counted(x, most, Stream.COUNT.seed(setting.seed, 100 * turn))
        setting, counts = replace(setting, pictures=pictures), pictures.counts
        if counts is None or abs(counts.count - count) <= STILL * count or setting.course.should_stop():
            break
        count = counts.count
        held, stream = setting.extras, Stream.POLISH_COUNTED
        ends = [
            _pool(setting, stage, start, held, stream, 10 * turn, steps=COUNTED_STEPS, paths=few).x
            for start in ([x] if turn else raced)
        ]
        x = ends[choose_end(pictures, ends, setting.plan, setting.seed, Stream.CHOOSE_COUNTED, GUARD_PARTS * turn)]
    return setting, x


def _pool(
    setting: Setting,
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
    plan, pictures, width = setting.plan, setting.pictures, setting.table.width
    stopped, counts = setting.course.should_stop, pictures.counts
    x, equations, size = start.copy(), None, 0
    most = plan.polish_pixels
    if counts is not None:
        most = min(most, (paths or plan.counted_paths) // counts.count)
    pools = TilePools.of((pictures.tiles(size, most) for size in TILE_SIZES), 1 + setting.table.length)
    # few pixels need more paths each: products of two noisy numbers average slowly
    samples = int(np.clip(plan.polish_paths // len(pools.pixels), 2, MOST_SAMPLES))
    most = min(GROWTH * samples, MOST_SAMPLES)
    unseen = plan.unseen**2
    if counts is not None:
        samples = most = counts.count
        unseen /= counts.mean_noise  # differences count in deviations of the noise
    moved, settled = 0.0, 0
    for turn in range(steps or plan.polish_steps):
        (rows,) = pictures.tables(pools.pixels, x[None], stream.seed(setting.seed, first + turn), samples)
        if stopped():
            break
        rows[..., 1:][..., frozen] = 0.0
        far = FAR[pictures.paths.roughness(x) < SECANT_BELOW]
        pools.fade(1.0 / (1.0 + (moved / far) ** 2))
        pools.add(np.split(rows, 2), samples)
        equations, noise, size = pools.best(width)
        setting.note(stage, x, equations.cost)
        step = setting.step(equations, x, POLISH_DAMPING, POLISH_TRUST, frozen, noise)
        moved = _moved(setting, step)
        x = x + step
        pools.shifted(step)
        stage.vector = x
        error = pools.expected_error(equations, noise, size, width)
        near = moved <= far and error.total < plan.enough * error.there
        if error.total > unseen and error.own >= OWN * error.total:
            near = False
            if turn >= FEW_STEPS:
                samples = min(2 * samples, most)
        settled = settled + 1 if near else 0
        if settled >= SETTLED and turn + 1 >= FEW_STEPS:
            break
    none = np.zeros_like(frozen)
    if equations is None:
        unknown = np.diag(width**2)
        return Polished(x, unknown, frozen, none, None, unknown)
    if pools.are_many and not stopped():
        # cautious steps end up to a deviation short of what all samples together say
        equations, _, size = pools.best(width)
        x = x + setting.step(equations, x, POLISH_DAMPING, POLISH_TRUST, frozen)
        stage.vector = x
    covariance, noise = pools.covariance(equations, size, width)
    again = None
    if steps is None:
        again = pictures.recount(x, pools.pixels, Stream.RECOUNT.seed(setting.seed, stream.value.first))
    if again is not None and not stopped():
        away = pools.answer(again.slope, equations, size, width)
        x = setting.table.clip(x + again.log_ratio * away)
        covariance = covariance + again.sd**2 * np.outer(away, away)
        stage.vector = x
    return Polished(x, covariance, frozen, none, equations, noise)


def _moved(setting: Setting, step: Vector) -> float:
    """How far a step goes, in parts of the range, in what moves the paths; all else is nearly linear."""
    table, way = setting.table, np.abs(step) / setting.table.width
    return max((float(way[table.slice_of(name)].max()) for name in GEOMETRIC if name in table.names), default=0.0)
