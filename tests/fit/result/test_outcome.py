# SPDX-License-Identifier: Apache-2.0
"""The result of a fit from a route's ends and the choice among them."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.result.outcome import START_KEPT, Choice, End, RouteEnds, final_result
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED
from mfo_backend.types.status import Status

TABLE = BLENDER_PRINCIPLED.select(["base_color", "roughness"])
START = np.array([0.1, 0.2, 0.3, 0.4])


def route(*ends: End, by_squares: int = 1) -> RouteEnds:
    return RouteEnds(ends, by_squares, lambda images: Choice(0, True), (), ("one",))


def result(found: RouteEnds, choice: Choice, status: Status = Status.CONVERGED):
    renderer = SimpleNamespace(table=TABLE, start=START, model="blender_principled", passes=7.0)
    errors = {"flip": (0.2, 0.1)}
    return final_result(
        renderer, found, choice, status=status, errors=errors, began=time.monotonic() - 5.0, notes=["two"]
    )


@pytest.mark.parametrize("status", [Status.CONVERGED, Status.CANCELLED])
@pytest.mark.parametrize("better", [False, True])
def test_it_says_what_was_found_and_whether_that_is_the_start(status, better):
    made = result(route(End("refine", START + 0.1)), Choice(0, better), status)
    assert (START_KEPT in made.message) == (not better and status is Status.CONVERGED)
    assert made.message.startswith(status.sentence)
    assert made.initial == {"base_color": (0.1, 0.2, 0.3), "roughness": 0.4}
    assert made.recovered["roughness"] == pytest.approx(0.5 if better else 0.4)
    assert made.bounds == {p.name: (p.lower, p.upper) for p in TABLE}
    assert (made.passes, made.notes, made.errors) == (7.0, ("one", "two"), {"flip": (0.2, 0.1)})
    assert 5.0 <= made.seconds < 60.0


@pytest.mark.parametrize(
    ("choice", "notes"),
    [
        (Choice(0, True), ["No perceptual stage was better", "of the first"]),
        (Choice(1, True), ["of the second"]),
        (Choice(0, False), []),
    ],
)
def test_sentences_on_an_end_are_said_of_the_result_alone(choice, notes):
    ends = End("refine", START + 0.1, notes=("of the first",)), End("itp", START + 0.2, notes=("of the second",))
    said = result(route(*ends), choice).notes
    assert said[0] == "one"
    assert said[-1] == "two"
    assert [note.startswith(start) for note, start in zip(said[1:-1], notes, strict=True)] == [True] * len(notes)
    assert result(route(*ends, by_squares=2), choice).notes == (
        ("one", *([ends[choice.end].notes[0]] if choice.beats_start else []), "two")
    )


@pytest.mark.parametrize(
    ("errors", "choice"),
    [
        ([0.3, 0.2, 0.1], Choice(1, True)),
        ([0.3, 0.2, 0.2], Choice(0, True)),
        ([0.1, 0.2, 0.1], Choice(1, False)),  # no better than the start is not worth a change
        ([0.3, np.nan, 0.2], Choice(1, True)),
        ([0.3, np.nan, np.inf], Choice(0, False)),
        ([np.nan, 0.5], Choice(0, True)),
    ],
)
def test_the_smallest_error_wins(errors, choice):
    assert Choice.of(errors) == choice
