# SPDX-License-Identifier: Apache-2.0
"""Which further picture would tell most of the values that are not determined.

Candidates are turns of the present camera around the target, the scene's other cameras, and from where the present
camera stands each lamp turned likewise or alone. Each is recorded with few lanes at the solution. Its derivatives join
those of the pictures that there are, and certainty is taken from all of them as it will be when the picture exists
(optimal design of experiments; V. Fedorov, "Theory of Optimal Experiments", 1972). The present picture is recorded in
the same way: how much larger its own derivatives are than those of the fit says in which unit a candidate's count.
Materials that explain the pictures as well are looked at in the candidate's: how far apart they are there says how much
of the doubt would be left.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...material.principled.blender_selection import AMOUNT_OF
from ...render.camera.primary_rays import TILE
from ...render.paths.recorded_image import TwoSamples
from ...render.paths.recorded_scene import RecordedScene
from ...render.sheet.turned_camera import View, side_by_side, target_center, turn_about, view_of
from ...types.certainty import Certainty, Level
from ...types.errors import BadInputError
from ...types.parameter import ParameterTable, Vector
from ...types.result import NextPicture
from ..alike.compare import Comparison
from ..candidates import Candidates
from ..certainty.covariance import Further, covariance
from ..result.outcome import listed
from ..squares.problem import Rival
from ..squares.recording_noise import MOST_OWN, rows_of_samples, without_own_noise
from ..squares.residuals import RelativeResidual
from ..tolerances import CHANCE, DETERMINED_BELOW, NOTHING_KNOWN, WORTH_A_PICTURE

TURNS = tuple(range(0, 360, 30))  # degrees; the first is the present camera
LAMP_TURNS = (90, 180, 270)  # degrees
SIDE = 80  # pixels along the longer side of a candidate, at most: some thousand see the target. No measurement
GRID = 1  # squared: camera rays of a pixel. No measurement
# So many of the best are recorded again with other random numbers and as fine as GRID_AGAIN squared: of 26 the best is
# one that chance favours. A ray that met a narrow coat's highlight promised its weight to 0.0003 where 0.09 came of it
# (docs/notebook/several_pictures.md).
LOOKED_AT_AGAIN, GRID_AGAIN = 3, 3
# Times that they are recorded, of which the geometric mean counts: what few lanes of a narrow lobe tell scatters by
# factors. Three recordings promised a coat's weight to 0.015, 0.061 and 0.31, and it came to 0.056
# (docs/notebook/several_pictures.md). No other number was tried. Larger: more time.
RECORDED_AGAIN = 3
# Information of a direction, of the largest, from which on the unit is taken from it. Smaller: noise of few lanes sets
# the unit. No measurement.
STRONG = 1e-3
_SAME_PLACE = 1e-3  # of matrices of cameras, metres and sines: far above float32, far below a turn of 30 degrees


@dataclass(frozen=True)
class Doubt:
    """Another material that explains the pictures about as well, and how they compare.

    `away` is its way from the solution in widths of the box.
    """

    rival: Rival
    away: Vector
    comparison: Comparison

    @property
    def spread(self) -> Vector:
        """What it adds to the covariance."""
        return np.outer(self.away, self.away)

    def share(self, times: float) -> float:
        """Its share after a picture whose two materials are `times` as far apart as in one of the present ones."""
        it = self.comparison
        further = it.distance * times
        before = max(it.better, 1e-12)
        deviation = math.sqrt(it.deviation**2 + 4.0 * it.inflation * further)
        return self.rival.share * min(NormalDist().cdf(-(it.more + further) / max(deviation, 1e-12)) / before, 1.0)


@dataclass(frozen=True)
class Evidence:
    """Residuals and derivatives (g, 3, 1 + k) of the fit at its solution, the recording's own noise in them, the least
    error of a residual, and how many `pictures` they are of."""

    rows: Vector
    own: Vector | None
    model_error: float
    pictures: int

    def with_further(self, told: _Told, unit: float, table: ParameterTable) -> Vector:
        """The covariance with a further picture, whose derivatives count in this `unit`.

        Its residuals are as large as the present ones, tile by tile, whose three channels share most of their noise.
        """
        further = Further(told.rows[:, :, 1:] / unit, None if told.own is None else told.own[:, :, 1:] / unit)
        return covariance(self.rows, self.own, table, self.model_error, further)

    def unit_of(self, present: _Told, table: ParameterTable) -> float:
        """How much larger the derivatives of the present picture's few lanes are than those of the fit.

        The median over the directions that the fit tells apart: where its lanes show next to nothing a ratio is noise.
        """
        there, here = (_gram(rows, own, table) for rows, own in ((self.rows, self.own), (present.rows, present.own)))
        levels, directions = np.linalg.eigh(there / self.pictures)
        strong = levels > STRONG * levels[-1]
        seen = np.einsum("ki,kl,li->i", directions, here, directions, optimize=True)
        return float(np.sqrt(max(np.median(seen[strong] / levels[strong]), 1e-30)))


@dataclass(frozen=True)
class _Told:
    """What a picture tells: derivatives (g, 3, 1 + k) of its residuals, the recording's own noise in them, and squared
    distances to each of the doubts' pictures."""

    rows: Vector
    own: Vector | None
    distances: Vector


@dataclass(frozen=True)
class Known:
    """What the present pictures tell: the solution, its covariance in widths of the box, and what that is taken from.

    `wanted` are the values that a further picture is for; `views` are where the pictures' cameras stand, as far as that
    is known; `doubts` are what else it may be.
    """

    x: Vector
    spread: Vector
    wanted: tuple[str, ...]
    evidence: Evidence
    views: tuple[View, ...] = ()
    doubts: tuple[Doubt, ...] = ()

    def has(self, view: View) -> bool:
        """Whether a picture has been made from there."""
        return any(np.allclose(view.to_world, there.to_world, atol=_SAME_PLACE) for there in self.views)


def open_values(x: Vector, certainty: Mapping[str, Certainty], user: Vector, table: ParameterTable) -> tuple[str, ...]:
    """Values that a further picture is for; none where all that is not determined is the user's own again.

    Details of a lobe that there may not be are none of them: what a picture tells of them hangs on the lobe.
    """

    def may_be_absent(amount: str | None) -> bool:
        if amount is None or amount not in certainty:
            return False  # it is given
        return bool((x[table.slice_of(amount)] <= CHANCE * np.array(certainty[amount].sd)).all())

    left = (name for name, c in certainty.items() if c.level is not Level.DETERMINED)
    names = tuple(name for name in left if not may_be_absent(AMOUNT_OF.get(name)))
    moved = (np.abs(x - user)[table.slice_of(name)].max() > 0.0 for name in names)
    return names if any(moved) else ()


@dataclass(frozen=True)
class Choice:
    """A picture that could be made; the fields are those of `NextPicture`."""

    turn: float = 0.0
    camera: str = ""
    light: str = ""
    light_turn: float = 0.0

    @property
    def words(self) -> str:
        """What a sentence calls it."""
        if self.light:
            if self.light_turn:
                return f"with the light '{self.light}' turned {_around(self.light_turn)}"
            return f"with the light '{self.light}' alone"
        if self.camera:
            return f"from the camera '{self.camera}'"
        return f"with the camera turned {_around(self.turn)}"


PRESENT = Choice()


def next_picture(scene: RecordedScene, known: Known, candidates: Candidates, seed: int) -> NextPicture | None:
    """The best of the scene's candidates and the present camera's turns; None where none is worth a picture."""
    table, wanted = scene.renderer.table, known.wanted
    center = target_center(scene.renderer.shape)
    now = np.sqrt(np.maximum(np.diag(known.spread), 1e-30))

    def best_first(predicted: Mapping[Choice, Vector]) -> list[Choice]:
        return sorted(predicted, key=lambda choice: _score(predicted[choice], now, wanted, table))

    with scene.renderer.counter.uncounted():  # the result is known without it
        first = best_first(predictions(known, dict(_told(scene, known, candidates, center, seed)), table))
        some = (PRESENT, *first[:LOOKED_AT_AGAIN])
        again = [
            predictions(
                known, dict(_told(scene, known, candidates, center, seed + k, grid=GRID_AGAIN, only=some)), table
            )
            for k in range(1, 1 + RECORDED_AGAIN if first else 1)
        ]
        predicted = _typical(again)
    if not predicted:
        return None
    best = best_first(predicted)[0]
    return _proposal(best, center, predicted[best], now, wanted, table)


def predictions(known: Known, all_told: Mapping[Choice, _Told], table: ParameterTable) -> dict[Choice, Vector]:
    """The deviations (k,) in widths of the box that values would have after each of the pictures that could be made."""
    # a camera that stands inside of something may see derivatives that are no numbers
    told = {choice: each for choice, each in all_told.items() if np.isfinite(each.rows).all()}
    own = told.pop(PRESENT, None)
    if own is None:
        return {}
    evidence = known.evidence
    unit = evidence.unit_of(own, table)

    def after(each: _Told) -> Vector:
        spread = evidence.with_further(each, unit, table)
        times = each.distances / np.maximum(own.distances, 1e-12) / evidence.pictures
        for doubt, more in zip(known.doubts, times, strict=True):
            spread = spread + doubt.share(float(more)) * doubt.spread
        return np.sqrt(np.maximum(np.diag(spread), 1e-30))

    return {choice: after(each) for choice, each in told.items()}


def _typical(predicted: Sequence[Mapping[Choice, Vector]]) -> dict[Choice, Vector]:
    """The geometric mean of several predictions, of what all of them have."""
    common = [choice for choice in (predicted[0] if predicted else ()) if all(choice in each for each in predicted)]
    return {choice: np.exp(np.mean([np.log(each[choice]) for each in predicted], axis=0)) for choice in common}


def _told(
    scene: RecordedScene,
    known: Known,
    candidates: Candidates,
    center: Vector,
    seed: int,
    *,
    grid: int = GRID,
    only: Sequence[Choice] | None = None,
) -> Iterator[tuple[Choice, _Told]]:
    """Choices with what a picture would tell; all of them, or `only` some, of which one is the present picture."""
    sensor = scene.renderer.scene.sensors()[0]
    width, height = (int(n) for n in sensor.film().crop_size())
    part = min(SIDE / max(width, height), 1.0)
    size = _whole_tiles(height * part), _whole_tiles(width * part)
    # a tile of the fit, for what is narrow is lost in its mean
    block = next((side for side in (TILE, TILE // 2) if side <= TILE * part * math.sqrt(2.0)), 1)
    own = view_of(sensor)
    if own is None:
        return
    turns = {turn: View(turn_about(center, turn) @ own.to_world, own.fov) for turn in TURNS}
    views = {Choice(turn=float(turn)): view for turn, view in turns.items()}
    for camera in candidates.cameras:
        views[Choice(camera=camera.name)] = View(np.reshape(camera.to_world, (4, 4)), camera.fov)
    views = {
        one: view
        for one, view in views.items()
        if (only is None or one in only) and (one == PRESENT or not known.has(view))
    }
    cameras = side_by_side(list(views.values()), size)

    def seen(pixels: NDArray[np.bool_] | None = None) -> Iterator[tuple[int, _Told]]:
        """By the number of a view."""
        try:
            paths = scene.record_from(cameras, known.x, grid=grid, seed=seed, pixels=pixels)
        except BadInputError:  # the target is in no sight
            return
        if paths.lanes == 0:
            return
        groups = paths.pixel_groups() if block == 1 else paths.tile_groups(side=block)
        at = scene.evaluator(paths, groups)
        samples, others = at.samples(known.x), [at.samples(doubt.rival.x) for doubt in known.doubts]
        numbers = groups.pixels[groups.first[:-1]] % (size[1] * len(views)) // size[1]
        for number in np.unique(numbers):
            here = numbers == number
            residual = RelativeResidual(np.maximum(samples.mean[here][:, :, 0], 0.0))
            rows, own = rows_of_samples(_of(samples, here), residual)
            apart = [_distance(*rows_of_samples(_of(other, here), residual), own) for other in others]
            yield int(number), _Told(rows, own, np.array(apart))

    choices = list(views)
    yield from ((choices[number], told) for number, told in seen())
    present = np.zeros((size[0], size[1] * len(views)), np.bool_)
    present[:, : size[1]] = True
    for choice, light in _other_light(scene, candidates, center):
        if only is not None and choice not in only:
            continue
        with light:
            yield from ((choice, told) for _, told in seen(present))


def _other_light(
    scene: RecordedScene, candidates: Candidates, center: Vector
) -> Iterator[tuple[Choice, AbstractContextManager[None]]]:
    """Choices with other light, and what makes it."""
    from ...render.lamps.changed_light import alone, has_other_light, lamp_named, turned  # which need a variant

    whole: Any = scene.renderer.scene
    for each in candidates.lights:
        lamp = lamp_named(whole, each.emitter)
        if lamp is None:
            continue
        if has_other_light(whole, lamp):
            yield Choice(light=each.name), alone(whole, lamp)
        for degrees in LAMP_TURNS:
            yield Choice(light=each.name, light_turn=float(degrees)), turned(lamp, turn_about(center, degrees))


def _whole_tiles(pixels: float) -> int:
    return max(round(pixels / TILE), 1) * TILE


def _of(samples: TwoSamples, here: NDArray[np.bool_]) -> TwoSamples:
    half = samples.half_difference
    return TwoSamples(samples.mean[here], None if half is None else half[here])


def _distance(rows: Vector, own: Vector | None, own_at_solution: Vector | None) -> float:
    """Sum of the squares of what a picture differs in, without the recording's own noise."""
    total = float(np.square(rows[:, :, 0]).sum())
    if own is None or own_at_solution is None:
        return total
    return max(total - float(np.square(own[:, :, 0] - own_at_solution[:, :, 0]).sum()), (1.0 - MOST_OWN) * total)


def _gram(rows: Vector, own: Vector | None, table: ParameterTable) -> Vector:
    """Products of derivatives by values in widths of the box, summed, without the recording's own noise."""
    width = table.width
    scaled = (rows[:, :, 1:] * width).reshape(-1, table.length)
    if own is None:
        return scaled.T @ scaled
    half = (own[:, :, 1:] * width).reshape(-1, table.length)
    return without_own_noise(scaled.T @ scaled, half.T @ half)


def _score(after: Vector, now: Vector, wanted: Sequence[str], table: ParameterTable) -> float:
    """How much of the wanted values' deviations is left; what is determined gains nothing by more."""
    entries = [i for name in wanted for i in range(*table.slice_of(name).indices(table.length))]
    return float(
        np.log(
            np.clip(after[entries], DETERMINED_BELOW, NOTHING_KNOWN) / np.minimum(now[entries], NOTHING_KNOWN)
        ).mean()
    )


def _proposal(
    choice: Choice, center: Vector, after: Vector, now: Vector, wanted: Sequence[str], table: ParameterTable
) -> NextPicture | None:
    worst = {name: float(after[table.slice_of(name)].max()) for name in wanted}
    before = {name: float(now[table.slice_of(name)].max()) for name in wanted}
    # a value may be called undetermined for what no deviation says, such as a rival: no picture of this promises that
    falls = [name for name, sd in worst.items() if WORTH_A_PICTURE * sd < before[name]]
    settles = tuple(name for name in falls if worst[name] < DETERMINED_BELOW)
    surer = tuple(name for name in falls if name not in settles)
    if not settles and not surer:
        return None
    width = {name: table[name].upper - table[name].lower for name in wanted}
    words = listed([table[name].shown for name in settles or surer])
    what = f"would settle {words}" if settles else f"would make {words} surer"
    return NextPicture(
        turn=_signed(choice.turn),
        center=(float(center[0]), float(center[1]), float(center[2])),
        settles=settles,
        predicted={name: worst[name] * width[name] for name in wanted if worst[name] < before[name]},
        sentence=f"A further picture {choice.words} {what}.",
        camera=choice.camera,
        light=choice.light,
        light_turn=_signed(choice.light_turn),
    )


def _signed(turn: float) -> float:
    return turn if turn <= 180.0 else turn - 360.0


def _around(turn: float) -> str:
    signed = _signed(turn)
    way = "against the clock" if signed > 0 else "clockwise"
    return f"by {abs(signed):.0f} degrees around the object ({way} from above)"
