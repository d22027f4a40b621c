# SPDX-License-Identifier: Apache-2.0
"""What the picture does not show goes back to the user's values, unless an eye would see the change."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit import tolerances
from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.recorded import keep_user_values as kept_values
from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.squares.problem import Rival
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.solve.bounded_least_squares import NormalEquations
from mfo_backend.types.certainty import Level
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.parameter import Parameter, ParameterTable
from tests.fit.recorded.one_refine import refine
from tests.render.scenes import AREA, POINT, SKY, write_scene

NAMES = ["base_color", "roughness", "sheen", "sheen_tint"]
TRUTH = {"base_color": (0.7, 0.2, 0.1), "roughness": 0.35, "sheen": 0.001, "sheen_tint": 0.001}
USER = {"base_color": (0.5, 0.5, 0.5), "roughness": 0.6, "sheen": 0.001, "sheen_tint": 0.4}


@pytest.mark.parametrize(("visible", "given_back"), [(tolerances.VISIBLE, True), (-1.0, False)], ids=["unseen", "seen"])
def test_undetermined_values_go_back_where_nothing_is_seen_of_it(tmp_path, monkeypatch, visible, given_back):
    # below zero, every change counts as seen
    monkeypatch.setattr(kept_values, "VISIBLE", visible)
    if not given_back:
        monkeypatch.setattr(kept_values, "UNSEEN_CHANGE", -1.0)
    renderer = load_renderer(
        write_scene(tmp_path, POINT, size=32), "target", model="mitsuba_principled", parameters=NAMES
    )
    renderer.start = renderer.table.pack(USER)
    reference = renderer.image(renderer.table.pack(TRUTH), seed=5, spp=512)
    result = recover_material(
        renderer,
        Image(reference, Encoding.LINEAR),
        FitSettings(preset="fast", verify_spp=16),
        listener=lambda event: None,
        should_stop=lambda: False,
    ).result
    assert any("The picture does not determine" in note for note in result.notes) == given_back
    assert (result.recovered["sheen_tint"] == pytest.approx(USER["sheen_tint"])) == given_back
    assert result.recovered["roughness"] == pytest.approx(TRUTH["roughness"], abs=0.01)


class Pictures:
    """A recording that shows grey pictures, one for each first value of a vector, and counts how often it is asked."""

    def __init__(self, greys):
        self.greys, self.shown, self.whole = greys, 0, self
        self.setting = SimpleNamespace(mask=np.ones((2, 2), bool))

    def picture(self, x):
        self.shown += 1
        return np.full((2, 2, 3), self.greys[float(x[0])])

    def rows(self, x):
        return np.full((4, 3, 1), self.greys[float(x[0])])

    def unseen(self, seen):
        refined = SimpleNamespace(x=np.array([0.0]), all=SimpleNamespace(evaluate=self.rows))
        return kept_values._UnseenChange(self, refined, seen)


def test_the_error_to_the_eye_may_grow_by_a_trace_only():
    fit = Pictures({0.0: 0.0, 1.0: 0.001, 2.0: 0.01})
    unseen = fit.unseen(lambda picture: float(picture.mean()))
    assert unseen(np.array([1.0]))
    assert not unseen(np.array([2.0]))
    assert fit.unseen(None)(np.array([2.0]))


def test_a_change_that_nobody_can_see_needs_no_picture():
    fit = Pictures({0.0: 1.0, 1.0: 1.0 + 0.9 * tolerances.UNSEEN_CHANGE, 2.0: 1.0 + 1.1 * tolerances.UNSEEN_CHANGE})
    unseen = fit.unseen(lambda picture: 1e6 * float(picture.mean()))
    assert unseen(np.array([1.0]))
    assert fit.shown == 0
    assert not unseen(np.array([2.0]))
    assert fit.shown == 2


@pytest.mark.parametrize("change", ["brighter", "either way", "another hue", "noise"])
@pytest.mark.parametrize("picture", ["even", "contrasty", "red"])
@pytest.mark.parametrize("name", ["flip-hdr", "flip-ldr"])
def test_such_a_change_moves_flip_less_than_what_counts_as_visible(picture, change, name):
    """Of the reference itself, where FLIP is steepest."""
    rng, shape = np.random.default_rng(0), (64, 64, 3)
    reference = {
        "even": rng.random(shape),
        "contrasty": np.exp(2.0 * rng.normal(size=shape)),
        "red": np.broadcast_to([0.9, 0.1, 0.2], shape),
    }[picture].astype(np.float32)
    sign = {
        "brighter": 1.0,
        "either way": rng.choice([-1.0, 1.0], shape[:2])[..., None],
        "another hue": np.array([1.0, -1.0, 1.0]),
        "noise": np.sqrt(np.pi / 2) * rng.normal(size=shape),  # its mean size is 1
    }[change]
    changed = (reference * (1.0 + tolerances.UNSEEN_CHANGE * sign)).astype(np.float32)
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    assert 0.0 < loss.value(changed) < tolerances.VISIBLE
    rows = [pixels.reshape(-1, 3) for pixels in (reference, changed)]
    assert kept_values.relative_change(*rows) == pytest.approx(tolerances.UNSEEN_CHANGE, rel=0.1)


TRADED = ParameterTable([Parameter(name, 1, 0.0, 1.0, 0.5) for name in ("roughness", "sheen", "sheen_tint", "coat")])


def test_values_that_trade_go_back_one_by_one_where_all_together_would_be_seen():
    # the picture shows the sum of sheen and coat, the roughness, and nothing of the tint
    shown = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    found, user = np.array([0.3, 0.6, 0.9, 0.5]), np.array([0.8, 0.4, 0.5, 0.1])

    def equations(x):
        residual = shown @ (x - found)
        return NormalEquations(0.5 * (float(residual @ residual) + 1e-4), shown.T @ residual, shown.T @ shown)

    problem = SimpleNamespace(equations=equations, independent=1000.0)
    unseen = ["sheen", "sheen_tint", "coat"]
    sets = list(kept_values._sets_to_return(unseen, [], problem, found, user, TRADED))
    assert sets[0] == unseen  # the sum would be 0.5 instead of 1.1
    assert "sheen_tint" in sets[1]
    assert len(sets[1]) == 2  # and one of the others, which the last one makes up for
    assert len(sets[2]) == 1
    # what is off already stays off: then the other one of the two cannot move
    sets = list(kept_values._sets_to_return(unseen, ["coat"], problem, np.array([0.3, 1.0, 0.9, 0.1]), user, TRADED))
    assert sets[1:] == [["sheen_tint"]]


def test_no_set_is_tried_twice():
    """The quadratic may promise that all can go back where the solve has just said no."""

    def equations(x):
        return NormalEquations(0.5e-4, np.zeros(4), np.diag([1.0, 0.0, 0.0, 0.0]))

    problem, unseen = SimpleNamespace(equations=equations, independent=1000.0), ["sheen", "sheen_tint", "coat"]
    for off in ([], ["coat"]):
        sets = list(kept_values._sets_to_return(unseen, off, problem, np.full(4, 0.3), np.full(4, 0.8), TRADED))
        held = [frozenset([*names, *off]) for names in sets]
        assert len(held) == 2
        assert len(set(held)) == 2


def test_another_material_that_is_as_likely_is_named_and_makes_values_unsure(tmp_path):
    renderer = load_renderer(
        write_scene(tmp_path, SKY + AREA, size=32), "target", model="mitsuba_principled", parameters=NAMES[:2]
    )
    table = renderer.table
    truth = table.pack({name: TRUTH[name] for name in NAMES[:2]})
    end = refine(renderer, renderer.image(truth, seed=5, spp=64), truth, RecordedPlan(), 1)
    refined = end.refined
    alone = kept_values.keep_values(end)
    assert alone.notes == ()
    assert alone.certainty["roughness"].level is Level.DETERMINED

    other = refined.x.copy()
    other[table.slice_of("roughness")] += 0.2
    rivals = replace(refined, rivals=(Rival(other, 0.25),))
    doubted = kept_values.keep_values(replace(end, refined=rivals))
    here = float(refined.x[table.slice_of("roughness")][0])
    assert doubted.notes == (
        f"With a probability of 25 % it is another material: roughness {here + 0.2:.2g} (not {here:.2g}).",
    )
    assert doubted.certainty["roughness"].sd[0] == pytest.approx(0.1, rel=0.05)  # half of 0.2: the root of the share
    assert doubted.certainty["roughness"].level is Level.WEAK
    assert doubted.certainty["base_color"] == alone.certainty["base_color"]
