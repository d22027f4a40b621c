# SPDX-License-Identifier: Apache-2.0
"""The frame of every fit: which route is taken and why, and what becomes of its ends."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit import recover_material as module
from mfo_backend.fit.paper.fit import WholePictures
from mfo_backend.fit.result.outcome import START_KEPT, Choice, End, RouteEnds
from mfo_backend.fit.settings import FitSettings
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.errors import UnrecordableError
from mfo_backend.types.event import Preview, Started
from mfo_backend.types.model_gap import ModelGap
from mfo_backend.types.status import Status
from mfo_backend.types.verdict import Verdict

from .conftest import SphereRenderer


def refusing(sentence):
    def route(*given):
        raise UnrecordableError(sentence)

    return route


def finding(ends, *, choose=None, notes=()):
    """A route that finds these ends at once and chooses by the mean error of their pictures, unless told otherwise."""

    class Route:
        stages = ("scan", "race")

        def __init__(self, task, *given):
            self.task = task
            self.verification = WholePictures(task.renderer, seed=77, spp=4, should_stop=task.should_stop)

        def fit(self):
            light = self.task.light
            by_error = lambda images: Choice.of([float(np.abs(i - light).mean()) for i in images])  # noqa: E731
            return RouteEnds(tuple(ends), 1, choose or by_error, (), tuple(notes))

    return Route


@pytest.fixture
def recover(sphere, truth, monkeypatch):
    monkeypatch.setattr(module, "MitsubaRenderer", SphereRenderer)
    monkeypatch.setattr(module, "RecordedRoute", refusing("Glass is not recorded."))
    monkeypatch.setattr(module, "TracedRoute", refusing("Hair is not traced."))

    def run(should_stop=lambda: False, listener=lambda event: None, hand_over=True, **settings):
        chosen = FitSettings(preset="balanced", max_iterations=3, **settings)
        return module.recover_material(
            sphere, sphere.reference(truth), chosen, listener=listener, should_stop=should_stop, hand_over=hand_over
        )

    return run


def test_the_first_route_that_can_is_taken_without_a_word(recover, truth, monkeypatch):
    monkeypatch.setattr(module, "RecordedRoute", finding([End("refine", truth)], notes=("one",)))
    outcome = recover()
    assert outcome.result.notes == ("one",)
    assert outcome.result.status is Status.CONVERGED


def test_the_last_note_says_why_light_paths_were_traced(recover, truth, monkeypatch):
    monkeypatch.setattr(module, "TracedRoute", finding([End("polish", truth)]))
    assert recover().result.notes == (
        "Glass is not recorded. So whole light paths were traced, by the stages 'scan', 'race'.",
    )


def test_the_papers_loop_stands_in_and_it_is_said(recover):
    assert recover().result.notes[0] == (
        "Glass is not recorded. Hair is not traced. So the preset 'paper' was used instead of 'balanced'."
    )
    assert recover(losses=("mse",)).result.notes[0] == (
        "Glass is not recorded. The stages on whole light paths know no losses of the user's choice. "
        "So the preset 'paper' was used instead of 'balanced'."
    )


def test_what_may_not_be_handed_over_is_refused_with_all_reasons(recover):
    with pytest.raises(UnrecordableError, match=r"Glass is not recorded\. Hair is not traced\."):
        recover(hand_over=False)


def test_the_best_end_is_the_result_with_what_is_known_of_it(recover, sphere, truth, monkeypatch):
    sure = {"roughness": Certainty((0.01,), Level.DETERMINED)}
    ends = [End("refine", truth + 0.1), End("itp", truth, sure, notes=("of the best",))]
    events = []
    monkeypatch.setattr(module, "RecordedRoute", finding(ends))
    outcome = recover(listener=events.append)
    np.testing.assert_allclose(sphere.table.pack(outcome.result.recovered), truth)
    assert outcome.result.certainty == sure
    assert outcome.result.notes == ("of the best",)
    assert outcome.result.errors["mse"][1] == 0.0 < outcome.result.errors["mse"][0]
    assert [type(event) for event in events] == [Started, Preview]
    assert events[0].stages == ("scan", "race")
    np.testing.assert_array_equal(events[1].image, outcome.result_image)


def test_the_start_is_kept_where_no_end_is_better(recover, sphere, truth, monkeypatch):
    far = End("refine", np.array([0.01, 0.9, 0.9, 1.0, 0.0]), notes=("of the end",))
    monkeypatch.setattr(module, "RecordedRoute", finding([far]))
    outcome = recover()
    assert outcome.result.recovered == outcome.result.initial
    assert START_KEPT in outcome.result.message
    assert "of the end" not in outcome.result.notes
    np.testing.assert_array_equal(outcome.result_image, outcome.start_image)


def test_the_result_is_judged_by_pictures_that_count_as_no_pass(recover, sphere, truth, monkeypatch):
    monkeypatch.setattr(module, "RecordedRoute", finding([End("refine", truth)]))
    given, gap = [], ModelGap(0.2, 0.3)
    monkeypatch.setattr("mfo_backend.fit.judge.model_gap.model_gap", lambda *of: given.append(of) or gap)
    outcome = recover()
    assert outcome.result.passes == sphere.passes == 2.0  # start and end; not the two halves
    assert len(sphere.calls) == len(set(sphere.calls)) + 1 == 4  # start and end see the same numbers, each half its own
    assert outcome.result.model_gap is gap
    assert outcome.result.notes == (gap.sentence,)
    assert len(given[0][1]) == 2


def test_a_stopped_fit_is_not_judged(recover, truth, monkeypatch):
    monkeypatch.setattr(module, "RecordedRoute", finding([End("refine", truth)]))
    stop = iter([False] * 2 + [True] * 100)
    outcome = recover(should_stop=lambda: next(stop))
    assert outcome.result.status is Status.CANCELLED
    assert outcome.result.model_gap is None
    assert outcome.result.judgement is None


def test_every_caller_has_the_verdict(recover, truth, monkeypatch):
    monkeypatch.setattr(module, "RecordedRoute", finding([End("refine", truth)]))
    assert recover().result.judgement.verdict is Verdict.SAME
    far = End("refine", np.array([0.5, 0.35, 0.25, 0.5, 0.5]))
    monkeypatch.setattr(module, "RecordedRoute", finding([far]))
    different = recover().result
    assert different.judgement.verdict is Verdict.DIFFERENT
    assert different.status is Status.DIFFERENT


def test_the_gap_is_that_of_the_start_where_the_end_is_dropped(recover, sphere, monkeypatch):
    """The route takes an end for the better one, and by eye it is visibly worse: values, pictures and gap go back."""
    far = End("refine", np.array([0.01, 0.9, 0.9, 1.0, 0.0]))
    monkeypatch.setattr(module, "RecordedRoute", finding([far], choose=lambda images: Choice(0, True)))
    given = []
    monkeypatch.setattr("mfo_backend.fit.judge.model_gap.model_gap", lambda *of: given.append(of))
    outcome = recover()
    assert outcome.result.recovered == outcome.result.initial
    assert START_KEPT in outcome.result.message
    assert outcome.result.errors["mse"][0] == outcome.result.errors["mse"][1]
    for picture in (outcome.result_image, *given[0][1]):
        np.testing.assert_array_equal(picture, sphere.shade(sphere.start).astype(np.float32))
