# SPDX-License-Identifier: Apache-2.0
"""Which materials may be fitted together, the light they begin in, and what a listener hears."""

from __future__ import annotations

from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.judge.fit_task import check_task
from mfo_backend.fit.materials import rounds
from mfo_backend.fit.materials.evened_light import evened_light
from mfo_backend.fit.materials.rounds import (
    FAILED,
    LIGHT_MOVED,
    MOST_VALUES,
    NOT_YET,
    Member,
    check_members,
    take_turns,
)
from mfo_backend.fit.materials.whole_course import WholeCourse
from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.result.outcome import FitOutcome
from mfo_backend.fit.settings import FitSettings
from mfo_backend.render.paths.recorded_scene import DIRECT, SceneNeeds
from mfo_backend.render.pictures.pass_counter import PassCounter
from mfo_backend.render.pictures.renderer import Interrupted
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.event import Progress, StageEnd, Started
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.parameter import Parameter, ParameterTable
from mfo_backend.types.result import FitResult
from mfo_backend.types.status import Status

LEFT = np.zeros((4, 8), bool)
LEFT[:, :4] = True


class Wall:
    """One of two walls in closed form: each is lit by a lamp and by the other."""

    def __init__(self, shown: dict[str, np.ndarray], name: str, mask: np.ndarray, values: int = 3) -> None:
        self.table = ParameterTable(
            [Parameter("base_color", 3, 1e-3, 0.999, (0.5, 0.5, 0.5))]
            + [Parameter(f"v{k}", 1, 0.0, 1.0, 0.5) for k in range(values - 3)]
        )
        self.model, self.counter, self.passes = "wall", PassCounter(), 0.0
        self.graph: SimpleNamespace | None = None
        self.start = self.table.pack({})
        self._shown, self._name, self._mask = shown, name, mask
        self.show(self.start)

    def show(self, vector: np.ndarray) -> None:
        self._shown[self._name] = vector[:3].copy()

    def image(self, vector: np.ndarray, *, seed: int, spp: int) -> np.ndarray:
        self.show(vector)
        return light_of(self._shown["left"], self._shown["right"])

    def target_mask(self) -> np.ndarray:
        return self._mask

    def otherwise_mask(self) -> np.ndarray:
        return np.zeros_like(self._mask)


def light_of(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Radiosity of two walls that see half of each other under irradiances of 1 and 0.3."""
    a, b = np.linalg.solve(
        np.array([[np.ones(3), -0.5 * left], [-0.5 * right, np.ones(3)]]).transpose(2, 0, 1),
        np.stack([left, 0.3 * right], axis=1)[..., None],
    )[..., 0].T
    return np.where(LEFT[..., None], a, b).astype(np.float32)


def walls(values: int = 3) -> list[Wall]:
    shown: dict[str, np.ndarray] = {}
    return [Wall(shown, "left", LEFT, values), Wall(shown, "right", ~LEFT, values)]


def test_colours_are_evened_with_the_light_that_the_walls_give_each_other() -> None:
    truth = np.array([0.8, 0.3, 0.1]), np.array([0.15, 0.6, 0.9])
    pair = walls()
    found = evened_light(pair, [LEFT, ~LEFT], light_of(*truth), 0)  # type: ignore[arg-type]
    alone = light_of(*truth)[0, 7] / light_of(*(wall.start[:3] for wall in walls()))[0, 7] * 0.5
    assert np.abs(alone - truth[1]).max() > 0.1  # what one step, or a fit beside walls as they were, would say
    for vector, colour in zip(found, truth, strict=True):
        assert vector[:3] == pytest.approx(colour, abs=0.01)


def test_colours_inside_nodes_are_evened_too() -> None:
    """A wall whose colour a ramp gives, beside one whose colour is its own."""
    truth = np.array([0.8, 0.3, 0.1]), np.array([0.15, 0.6, 0.9])
    pair = walls()
    pair[0].table = ParameterTable([Parameter("Color Ramp/Stop 0", 3, 0.0, 1.0, (0.5, 0.5, 0.5))])
    pair[0].graph = SimpleNamespace(colors_of=lambda name: ("Color Ramp/Stop 0",) if name == "base_color" else ())
    found = evened_light(pair, [LEFT, ~LEFT], light_of(*truth), 0)  # type: ignore[arg-type]
    for vector, colour in zip(found, truth, strict=True):
        assert vector[:3] == pytest.approx(colour, abs=0.01)


def members(values: int, preset: str = "balanced", *, queue: bool = False) -> list[Member]:
    return [
        Member(name, wall, FitSettings(preset=preset, queue=queue))  # type: ignore[arg-type]
        for name, wall in zip(("Left", "Right"), walls(values), strict=True)
    ]


LIT = Image(np.full((4, 8, 3), 0.5, np.float32), Encoding.LINEAR)


def test_120_values_are_fitted_together_and_121_are_not() -> None:
    check_members(members(MOST_VALUES // 2), LIT)
    with pytest.raises(BadInputError, match=r"have 122 free values, and at most 120 .*: leave out 'Left' \(61\), or"):
        check_members(members(MOST_VALUES // 2 + 1), LIT)


def test_a_queue_holds_any_number_of_values() -> None:
    check_members(members(MOST_VALUES, queue=True), LIT)


def test_what_fits_one_material_alone_is_refused() -> None:
    with pytest.raises(BadInputError, match="The preset 'paper' fits one material alone"):
        check_members(members(3, "paper"), LIT)
    pair = members(3)
    pair[1].renderer.target_mask().fill(False)
    try:
        with pytest.raises(BadInputError, match="Material 'Right': "):
            check_members(pair, LIT)
    finally:
        pair[1].renderer.target_mask()[:, 4:] = True


def test_many_fits_are_told_as_one() -> None:
    heard: list = []
    course = WholeCourse(["Floor", "Wall"], heard.append)
    for round_number in (1, 2, 3):
        for member in (1, 0):
            tell = course.of(member, round_number)
            tell(Started(("scan",), ("roughness",), 0.1))
            tell(Progress("scan", 0, 1, 3, 0.1, 0.1, 0.5, 0.0, 0.0))
            tell(StageEnd("scan", "converged", "", 1, 0.1, 0.1))
    assert [type(event).__name__ for event in heard].count("Started") == 1
    shares = [event.fraction for event in heard if isinstance(event, Progress)]
    assert shares == sorted(shares)
    assert 0.05 < shares[0] < 0.15
    assert shares[-1] < 1.0
    assert [event.stage for event in heard if isinstance(event, StageEnd)][:2] == ["Wall: scan", "Floor: scan"]


TRUTH = np.array([0.8, 0.3, 0.1]), np.array([0.15, 0.6, 0.9])
SHOWN = Image(light_of(*TRUTH), Encoding.LINEAR)


class Fits:
    """Stands in for a fit of one wall: what it finds is exact in the light that the other gives as it is shown."""

    def __init__(
        self, stop_after: int = 100, *, fails_at: tuple[int | None, Exception] = (-1, ValueError("never"))
    ) -> None:
        self.fails_at, self.failure = fails_at  # the number of a call, or None for all
        self.calls: list[tuple[str, str, bool]] = []
        self.recorded: list[object] = []
        self.plans: list[object] = []
        self.stop_after = stop_after

    def __call__(self, wall: Wall, reference: Image, settings: FitSettings, **options: object) -> FitOutcome:
        self.calls.append((wall._name, settings.preset, options["begin"] is not None))
        if self.fails_at in (None, len(self.calls) - 1):
            raise self.failure
        self.recorded.append(options["recorded"])
        self.plans.append(options["plan"])
        left = wall._name == "left"
        bright, lamp, lamp_of_other = (SHOWN.pixels[0, 0 if left else 7], *((1.0, 0.3) if left else (0.3, 1.0)))
        other = wall._shown["right" if left else "left"]
        colour = bright / (lamp + 0.5 * other * (lamp_of_other + 0.5 * bright))
        values = {"base_color": tuple(map(float, colour))}
        own = wall.table.unpack(wall.start)
        result = FitResult(Status.CONVERGED, "", "wall", own, values, {}, (), {}, 0.0, 0.0)
        return FitOutcome(result, SHOWN.pixels, SHOWN.pixels, wall.target_mask())

    def stopped(self) -> bool:
        return len(self.calls) >= self.stop_after


def turns(
    fits: Fits, monkeypatch: pytest.MonkeyPatch, *, queue: bool = False, recorded: tuple = (None, None)
) -> rounds.Turns:
    monkeypatch.setattr(rounds, "recover_material", fits)
    monkeypatch.setattr(rounds, "evened_light", lambda renderers, *_: [r.start.copy() for r in renderers])
    three = members(3, queue=queue)
    tasks = [check_task(m.renderer, SHOWN, m.settings, None, lambda event: None, fits.stopped) for m in three]
    return take_turns(three, tasks, recorded)


def test_turns_end_when_the_light_holds_still(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = Fits()
    found = turns(fits, monkeypatch)
    assert found.still
    for vector, colour in zip(found.present, TRUTH, strict=True):
        assert vector == pytest.approx(colour, abs=LIGHT_MOVED)
    assert fits.calls[:2] == [("left", "fast", False), ("right", "fast", False)]
    # in the preset's own way, once at least; what saw other light in the first round is searched again
    assert fits.calls[2:4] == [("left", "balanced", False), ("right", "balanced", False)]
    assert set(fits.calls[4:]) <= {("left", "balanced", True), ("right", "balanced", True)}
    assert len(fits.calls) < 2 * rounds.MOST_ROUNDS  # what sees the same light is not fitted again


def test_after_each_fit_all_are_rendered_once(monkeypatch: pytest.MonkeyPatch) -> None:
    pictures: list[str] = []
    image = Wall.image

    def counted(wall: Wall, vector: np.ndarray, **how: int) -> np.ndarray:
        pictures.append(wall._name)
        return image(wall, vector, **how)

    monkeypatch.setattr(Wall, "image", counted)
    fits = Fits()
    turns(fits, monkeypatch)
    assert len(pictures) == len(fits.calls)


def test_a_queue_fits_each_once_and_quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = Fits()
    found = turns(fits, monkeypatch, queue=True)
    assert fits.calls == [("left", "fast", False), ("right", "fast", False)]
    assert (found.rounds, found.still) == (1, True)
    # no later round mends what a recording's own noise did to few pixels
    assert fits.plans == [RecordedPlan.of("fast").of_a_small_target()] * 2


class Scene:
    """What records a wall; it counts how often it is asked what it needs."""

    def __init__(self, depth: int) -> None:
        self._needs, self.asked = SceneNeeds(True, depth, ()), 0

    @cached_property
    def needs(self) -> SceneNeeds:
        self.asked += 1
        return self._needs


@pytest.mark.parametrize(("depth", "asked"), [(16, 0), (DIRECT, 1)])
def test_what_light_is_recorded_is_asked_for_the_largest_and_holds_for_all(monkeypatch, depth, asked) -> None:
    """A probe for each material and round took a sixth of a queue's time."""
    fits, scenes = Fits(), (Scene(depth), Scene(16))
    turns(fits, monkeypatch, recorded=scenes)
    assert (scenes[0].asked, scenes[1].asked) == (1, asked)
    assert fits.recorded[:2] == [*scenes]  # each its own, in every round
    assert set(map(id, fits.recorded)) == set(map(id, scenes))


def test_what_was_found_before_a_stop_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turns(Fits(stop_after=1), monkeypatch)
    first, second = found.outcomes
    assert first.result.status is Status.CONVERGED
    assert (second.result.status, second.result.notes) == (Status.CANCELLED, (NOT_YET,))
    assert second.result.recovered == second.result.initial
    assert found.present[1] == pytest.approx(walls()[1].start)
    with pytest.raises(Interrupted):
        turns(Fits(stop_after=0), monkeypatch)


@pytest.mark.parametrize("queue", [False, True])
def test_a_fit_that_fails_loses_no_other(queue: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    fits = Fits(fails_at=(1 if queue else 3, np.linalg.LinAlgError("Singular matrix")))
    found = turns(fits, monkeypatch, queue=queue)
    first, second = found.outcomes
    assert first.result.status is Status.CONVERGED
    # of the two words that all materials together know, and none is applied without being asked for
    assert second.result.status is (Status.DIFFERENT if queue else Status.CONVERGED)
    assert second.result.notes == (FAILED.format(what="LinAlgError: Singular matrix"),)
    # what an earlier round has found of it stays, and none tries again
    assert (second.result.recovered == second.result.initial) is queue
    assert found.present[1] == pytest.approx(walls()[1].table.pack(second.result.recovered))
    assert [name for name, *_ in fits.calls].count("right") == (1 if queue else 2)
    with pytest.raises(MemoryError):
        turns(Fits(fails_at=(None, MemoryError())), monkeypatch, queue=queue)
    with pytest.raises(BadInputError):
        turns(Fits(fails_at=(1, BadInputError("It is refused."))), monkeypatch, queue=queue)
