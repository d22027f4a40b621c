# SPDX-License-Identifier: Apache-2.0
"""What is said of a result and of its values, by verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.fit.judge import judged_result as judged_results
from mfo_backend.fit.judge import verdict
from mfo_backend.fit.judge.beyond_noise import beyond_noise
from mfo_backend.fit.judge.judged_result import judged_result
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.result import Contradiction, FitResult, PictureResult
from mfo_backend.types.status import Status
from mfo_backend.types.verdict import Cause, Difference, Judgement, Verdict

MASK = np.ones((48, 48), bool)
VIEW = DisplayView()


def flat(level):
    return np.full((48, 48, 3), level, np.float32)


def result(status=Status.CONVERGED):
    return FitResult(
        status=status,
        message=f"{status.sentence} More.",
        model="blender_principled",
        initial={"roughness": 0.5, "coat_weight": 0.0, "sheen_weight": 0.0, "metallic": 0.0},
        recovered={"roughness": 0.2, "coat_weight": 0.7, "sheen_weight": 0.0, "metallic": 0.1},
        bounds={},
        stages=(),
        errors={"flip": (0.3, 0.1)},
        seconds=1.0,
        passes=1.0,
        certainty={
            "roughness": Certainty((0.01,), Level.DETERMINED),
            "coat_weight": Certainty((0.5,), Level.NOT_VISIBLE, ("roughness", "base_color")),
            "sheen_weight": Certainty((0.5,), Level.NOT_VISIBLE, ("roughness",)),
            "metallic": Certainty((0.5,), Level.NOT_VISIBLE),
        },
    )


def judged(reference, start, end, given=None):
    return judged_result(given or result(), Image(flat(reference), Encoding.LINEAR), flat(start), flat(end), MASK, VIEW)


def words(found):
    return {name: certainty.words for name, certainty in found.certainty.items()}


def test_a_match_keeps_its_status_and_what_is_sure():
    found, picture = judged(0.3, 0.1, 0.3)
    assert found.judgement.verdict is Verdict.SAME
    assert found.status is Status.CONVERGED
    assert found.message == "The result looks the same as the reference. More."
    assert words(found) == {
        "roughness": "determined",
        "coat_weight": "not told apart from Roughness, Base Color",
        "sheen_weight": "not visible, kept",
        "metallic": "changed, hardly visible",
    }
    assert np.array_equal(picture, flat(0.3))


def test_nothing_is_determined_where_the_picture_is_not_matched():
    found, _ = judged(0.3, 0.005, 0.05)
    assert found.judgement.verdict is Verdict.DIFFERENT
    assert found.status is Status.DIFFERENT
    assert found.status.exit_code == 5
    assert found.message.startswith("The result does not match the reference.")
    assert "converged" not in found.message
    assert words(found)["roughness"] == "doubtful, as the picture is not matched"


@pytest.mark.parametrize(
    ("verdict", "cause", "said"),
    [
        (Verdict.SAME, None, "determined"),
        (Verdict.CLOSE, Cause.NOISE, "determined"),  # nothing differs that is not noise
        (Verdict.CLOSE, Cause.NOTED, "doubtful, as the picture is not matched"),
        (Verdict.CLOSE, Cause.SURROUNDINGS, "doubtful, as the picture is not matched"),
        (Verdict.CLOSE, None, "doubtful, as the picture is not matched"),
    ],
)
def test_values_that_may_make_up_for_what_differs_are_not_determined(monkeypatch, verdict, cause, said):
    judgement = Judgement(verdict, cause, Difference(0.05, 0.0, 0.02, 0.02, 0.0))
    monkeypatch.setattr(judged_results, "judge", lambda *_, **__: judgement)
    found, _ = judged(0.3, 0.005, 0.29)
    assert words(found)["roughness"] == said
    assert found.status is Status.CONVERGED


def test_a_cancelled_fit_stays_cancelled():
    assert judged(0.3, 0.005, 0.05, result(Status.CANCELLED))[0].status is Status.CANCELLED


@pytest.mark.parametrize(("end", "pictures"), [(0.3, 1), (0.305, 1), (0.1, 3)])
def test_each_picture_is_compared_once(monkeypatch, end, pictures):
    """That of the start only where the result could be farther; where it is, its verdict is the start's."""
    compared = []

    def counted(*given):
        compared.append(given)
        return beyond_noise(*given)

    monkeypatch.setattr(verdict, "beyond_noise", counted)
    judged(0.3, 0.29, end)
    assert len(compared) == pictures


def test_what_is_worse_than_the_start_is_not_the_result():
    found, picture = judged(0.3, 0.29, 0.1)
    assert found.recovered == found.initial
    assert found.errors == {"flip": (0.3, 0.3)}
    assert found.certainty == {}
    assert found.message.endswith("Nothing was better than the start, so the start was kept.")
    assert np.array_equal(picture, flat(0.29))


def test_the_cause_of_a_picture_that_contradicts_the_others_is_that_alone():
    far = Judgement(Verdict.DIFFERENT, Cause.MATERIAL, Difference(0.5, 0.0, 0.4, 0.4, 0.0))
    near = Judgement(Verdict.SAME, None, Difference(0.0, 0.0, 0.0, 0.0, 0.0))
    errors = {"flip": (0.3, 0.1)}
    named = Contradiction(("2 (b.exr)",), "Picture 2 does not go with the rest.")

    def message(of_first, of_second):
        pictures = (PictureResult("1 (a.exr)", errors, of_first), PictureResult("2 (b.exr)", errors, of_second))
        given = replace(result(), contradiction=named, message=named.sentence)
        found, _ = judged_result(
            given, Image(flat(0.3), Encoding.LINEAR), flat(0.1), flat(0.3), MASK, VIEW, judge_all=lambda _: pictures
        )
        return found.message

    assert Cause.MATERIAL.sentence not in message(near, far)
    assert Cause.MATERIAL.sentence in message(far, near)
