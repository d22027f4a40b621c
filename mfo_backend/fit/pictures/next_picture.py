# SPDX-License-Identifier: Apache-2.0
"""Which further picture would tell most of the values that are not determined.

Candidates are turns of the present camera around the target, the scene's other cameras, and from where the present
camera stands each lamp turned likewise or alone. Each is recorded with few lanes at the solution. Its normal equations
add to the information that there is, so
the covariance with it is (C^-1 + I)^-1, before the picture exists (optimal design of experiments; V. Fedorov, "Theory
of Optimal Experiments", 1972). The present picture is recorded in the same way, and what it tells is
known: C^-1. A candidate tells as much more or less of it as its normal equations are larger or smaller, in the
directions in which they differ most; the noise of so few lanes is in both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...render.paths.recorded_image import TwoSamples
from ...render.paths.recorded_scene import RecordedScene
from ...render.sheet.turned_camera import View, side_by_side, target_center, turn_about, view_of
from ...types.certainty import Certainty, Level
from ...types.errors import BadInputError
from ...types.parameter import ParameterTable
from ...types.result import NextPicture
from ..candidates import Candidates
from ..squares.recording_noise import rows_of_samples, without_own_noise
from ..squares.residuals import RelativeResidual
from ..tolerances import DETERMINED_BELOW, NOTHING_KNOWN, WORTH_A_PICTURE

Vector = NDArray[np.float64]

TURNS = tuple(range(0, 360, 30))  # degrees; the first is the present camera
LAMP_TURNS = (90, 180, 270)  # degrees
MOST_CAMERAS, MOST_LAMPS = 12, 3  # that are looked at: each lamp's recordings take 0.3 s of processor time
SIDE = 40  # pixels along the longer side of a candidate: some hundred see the target
GRID = 2  # squared: camera rays of a pixel
_RIDGE = 1e-9  # of the largest entry
_SAME_PLACE = 1e-3  # of matrices of cameras, metres and sines


@dataclass(frozen=True)
class Known:
    """What the present `pictures` tell: the solution and its covariance in widths of the box.

    `user` are the scene's own values; `views` are where the pictures' cameras stand, as far as that is known.
    """

    x: Vector
    spread: Vector
    certainty: Mapping[str, Certainty]
    user: Vector
    pictures: int
    views: tuple[View, ...] = ()

    def open(self, table: ParameterTable) -> tuple[str, ...]:
        """Values that a further picture is for; none where all that is not determined is the user's own again."""
        names = tuple(name for name, c in self.certainty.items() if c.level is not Level.DETERMINED)
        moved = (np.abs(self.x - self.user)[table.slice_of(name)].max() > 0.0 for name in names)
        return names if any(moved) else ()

    def has(self, view: View) -> bool:
        """Whether a picture has been made from there."""
        return any(np.allclose(view.to_world, there.to_world, atol=_SAME_PLACE) for there in self.views)


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
    table = scene.renderer.table
    wanted = known.open(table)
    if not wanted or scene.varies:
        return None
    center = target_center(scene.renderer.shape)
    with scene.renderer.counter.uncounted():  # the result is known without it
        told = dict(_told(scene, known, candidates, center, seed))
    own = told.pop(PRESENT, None)
    if own is None or not told:
        return None
    of_pictures = np.linalg.inv(_regular(known.spread))
    of_one = of_pictures / known.pictures
    predicted = [(one, _deviations(of_pictures + _information(gram, own, of_one))) for one, gram in told.items()]
    now = _deviations(of_pictures)
    best, after = min(predicted, key=lambda one: _score(one[1], now, wanted, table))
    return _proposal(best, center, after, now, wanted, table)


def _information(candidate: Vector, present: Vector, known: Vector) -> Vector:
    """What a candidate tells, from its products of derivatives, those of the present camera, and what that told.

    In the basis V with V' present V = 1 and V' candidate V = diag(l), each direction counts l times.
    """
    root = np.linalg.inv(np.linalg.cholesky(_regular(present)))
    ratios, directions = np.linalg.eigh(root @ candidate @ root.T)
    basis = root.T @ directions
    scale = np.sqrt(np.maximum(ratios, 0.0))
    back = np.linalg.inv(basis)
    return back.T @ (scale[:, None] * (basis.T @ known @ basis) * scale) @ back


def _deviations(information: Vector) -> Vector:
    return np.sqrt(np.maximum(np.diag(np.linalg.inv(information)), 1e-30))


def _told(
    scene: RecordedScene, known: Known, candidates: Candidates, center: Vector, seed: int
) -> Iterator[tuple[Choice, Vector]]:
    """Choices with the products of derivatives that a picture of the present size would have, by tile of one pixel."""
    sensor = scene.renderer.scene.sensors()[0]
    width, height = (int(n) for n in sensor.film().crop_size())
    part = SIDE / max(width, height)
    size = max(round(height * part), 4), max(round(width * part), 4)
    own = view_of(sensor)
    if own is None:
        return
    turns = {turn: View(turn_about(center, turn) @ own.to_world, own.fov) for turn in TURNS}
    views = {Choice(turn=float(turn)): view for turn, view in turns.items()}
    for camera in candidates.cameras[:MOST_CAMERAS]:
        views[Choice(camera=camera.name)] = View(np.reshape(camera.to_world, (4, 4)), camera.fov)
    views = {one: view for one, view in views.items() if one == PRESENT or not known.has(view)}
    cameras = side_by_side(list(views.values()), size)
    table, share = scene.renderer.table, width * height / (size[0] * size[1])

    def grams(pixels: NDArray[np.bool_] | None = None) -> Iterator[tuple[int, Vector]]:
        """By the number of a view."""
        try:
            paths = scene.record_from(cameras, known.x, grid=GRID, seed=seed, pixels=pixels)
        except BadInputError:  # the target is in no sight
            return
        if paths.lanes == 0:
            return
        groups = paths.pixel_groups()
        samples = scene.evaluator(paths, groups).samples(known.x)
        numbers = paths.pixel % (size[1] * len(views)) // size[1]
        for number in np.unique(numbers):
            here = numbers == number
            mean = samples.mean[here]
            half = None if samples.half_difference is None else samples.half_difference[here]
            rows, own = rows_of_samples(TwoSamples(mean, half), RelativeResidual(np.maximum(mean[:, :, 0], 0.0)))
            yield int(number), _gram(rows, own, table) * share

    choices = list(views)
    yield from ((choices[number], gram) for number, gram in grams())
    present = np.zeros((size[0], size[1] * len(views)), np.bool_)
    present[:, : size[1]] = True
    for choice, light in _other_light(scene, candidates, center):
        with light:
            yield from ((choice, gram) for _, gram in grams(present))


def _other_light(
    scene: RecordedScene, candidates: Candidates, center: Vector
) -> Iterator[tuple[Choice, AbstractContextManager[None]]]:
    """Choices with other light, and what makes it."""
    from ...render.lamps.changed_light import alone, has_other_light, lamp_named, turned  # which need a variant

    whole: Any = scene.renderer.scene
    for each in candidates.lights[:MOST_LAMPS]:
        lamp = lamp_named(whole, each.emitter)
        if lamp is None:
            continue
        if has_other_light(whole, lamp):
            yield Choice(light=each.name), alone(whole, lamp)
        for degrees in LAMP_TURNS:
            yield Choice(light=each.name, light_turn=float(degrees)), turned(lamp, turn_about(center, degrees))


def _gram(rows: Vector, own: Vector | None, table: ParameterTable) -> Vector:
    """Products of derivatives by values in widths of the box, summed, without the recording's own noise."""
    width = table.upper - table.lower
    scaled = (rows[:, :, 1:] * width).reshape(-1, table.length)
    if own is None:
        return scaled.T @ scaled
    half = (own[:, :, 1:] * width).reshape(-1, table.length)
    return without_own_noise(scaled.T @ scaled, half.T @ half)


def _regular(matrix: Vector) -> Vector:
    return matrix + _RIDGE * max(float(np.diag(matrix).max()), 1e-300) * np.eye(len(matrix))


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
    what = f"would settle {_listed(settles, table)}" if settles else f"would make {_listed(surer, table)} surer"
    return NextPicture(
        turn=_signed(choice.turn),
        center=(float(center[0]), float(center[1]), float(center[2])),
        settles=settles,
        predicted={name: worst[name] * width[name] for name in wanted},
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


def _listed(names: Sequence[str], table: ParameterTable) -> str:
    words = [table[name].shown for name in names]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
