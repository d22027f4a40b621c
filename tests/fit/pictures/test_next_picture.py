# SPDX-License-Identifier: Apache-2.0
"""What a proposal promises of values whose deviations before and after a further picture are given."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.certainty.covariance import covariance
from mfo_backend.fit.pictures import next_picture
from mfo_backend.fit.pictures.next_picture import (
    PRESENT,
    Choice,
    Evidence,
    Known,
    _proposal,
    _Told,
    open_values,
    predictions,
)
from mfo_backend.render.pictures.pass_counter import PassCounter
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable([Parameter("roughness", 1, 0.0, 1.0, 0.5), Parameter("coat_weight", 1, 0.0, 1.0, 0.5)])


@pytest.mark.parametrize(
    ("before", "after", "settles", "ends"),
    [
        ((0.2, 0.3), (0.01, 0.1), ("roughness",), "would settle Roughness."),
        ((0.2, 0.3), (0.05, 0.2), (), "would make Roughness surer."),
        # undetermined for another reason than its deviation, as a rival: this hardly falls
        ((0.012, 0.3), (0.008, 0.1), (), "would make Coat Weight surer."),
    ],
)
def test_what_a_picture_settles_is_what_falls(before, after, settles, ends):
    found = _proposal(Choice(turn=60.0), np.zeros(3), np.array(after), np.array(before), TABLE.names, TABLE)
    assert found is not None
    assert found.settles == settles
    assert found.sentence.endswith(ends)


def test_where_no_deviation_falls_nothing_is_proposed():
    assert (
        _proposal(Choice(turn=60.0), np.zeros(3), np.array([0.015, 0.2]), np.array([0.019, 0.3]), TABLE.names, TABLE)
        is None
    )


def test_nothing_is_promised_of_a_value_that_no_picture_shows():
    found = _proposal(Choice(), np.zeros(3), np.array([0.1, 0.5753]), np.array([0.3, 0.5752]), TABLE.names, TABLE)
    assert found is not None
    assert list(found.predicted) == ["roughness"]


@pytest.mark.parametrize(
    ("weight", "sd", "asked"),
    [(0.165, 0.226, ["roughness", "coat_weight"]), (0.67, 0.2, ["roughness", "coat_weight", "coat_roughness"])],
)
def test_details_of_a_lobe_that_there_may_not_be_are_not_asked_for(weight, sd, asked):
    """Scene 7 of `studies.views` promised the roughness of such a coat ten times as well as it came; 8 has its coat."""
    table = ParameterTable([*TABLE, Parameter("coat_roughness", 1, 0.0, 1.0, 0.5)])
    certainty = {name: Certainty((each,), Level.WEAK) for name, each in zip(table.names, (0.05, sd, 0.1), strict=True)}
    assert list(open_values(np.array([0.5, weight, 0.17]), certainty, np.zeros(3), table)) == asked
    # an amount that is given is there
    details = {"coat_roughness": certainty["coat_roughness"]}
    alone = ParameterTable([table["coat_roughness"]])
    assert open_values(np.array([0.17]), details, np.zeros(1), alone) == ("coat_roughness",)


def test_a_candidate_whose_derivatives_are_no_numbers_is_passed_over():
    """From inside of a mesh some are not; the result of the fit was lost by it."""
    random = np.random.default_rng(0)
    rows = [random.normal(size=(40, 3, 3)) for _ in range(4)]
    rows[2][5, 1, 2] = np.inf
    choices = (PRESENT, Choice(turn=60.0), Choice(turn=90.0))
    told = {choice: _Told(each, None, np.empty(0)) for choice, each in zip(choices, rows[1:], strict=True)}
    known = Known(np.full(2, 0.5), np.eye(2), TABLE.names, Evidence(rows[0], None, 0.002, 1))
    found = predictions(known, told, TABLE)
    assert Choice(turn=60.0) not in found
    assert np.isfinite(found[Choice(turn=90.0)]).all()


def test_a_second_picture_like_the_first_is_predicted_as_it_turns_out():
    """Oracle: the covariance with a picture of other noise, whose three channels share it, and another scale."""
    random = np.random.default_rng(1)

    def rows(scale: float) -> np.ndarray:
        shared = 0.3 * np.repeat(random.normal(size=(300, 1)), 3, axis=1)
        slopes = random.normal(size=(300, 1, 2)) + 0.1 * random.normal(size=(300, 3, 2))
        return np.concatenate([shared[:, :, None], scale * slopes * [1.0, 0.2]], axis=2)

    first, second = rows(1.0), rows(1.0)
    told = _Told(7.0 * second, None, np.empty(0))
    predicted = Evidence(first, None, 0.0, 1).with_further(told, 7.0, TABLE)
    realised = covariance(np.concatenate([first, second]), None, TABLE, 0.0)
    np.testing.assert_allclose(np.sqrt(np.diag(predicted)), np.sqrt(np.diag(realised)), rtol=0.15)


def test_what_chance_favours_is_looked_at_again(monkeypatch):
    """A ray that met a highlight made one candidate of many look best; with others, of many rays, it tells little."""
    random = np.random.default_rng(2)
    present = random.normal(size=(200, 3, 3)) * [1.0, 1.0, 0.02]

    def told(*given: object, grid: int = 1, only: tuple[Choice, ...] | None = None):
        for choice in only or (PRESENT, Choice(turn=60.0), Choice(turn=90.0)):
            rows = present.copy()
            rows[:, :, 2] *= 10.0 if choice.turn == 90.0 else 1.0
            if choice.turn == 60.0 and grid == 1:
                rows[7, :, 2] = 1e3
            yield choice, _Told(rows, None, np.empty(0))

    monkeypatch.setattr(next_picture, "_told", told)
    monkeypatch.setattr(next_picture, "target_center", lambda shape: np.zeros(3))
    scene = SimpleNamespace(renderer=SimpleNamespace(table=TABLE, shape=None, counter=PassCounter()))
    evidence = Evidence(present, None, 0.0, 1)
    known = Known(np.full(2, 0.5), covariance(present, None, TABLE, 0.0), ("coat_weight",), evidence)
    found = next_picture.next_picture(scene, known, SimpleNamespace(), 0)
    assert found is not None
    assert found.turn == 90.0


def test_a_recording_that_promises_too_much_is_one_of_several(monkeypatch):
    """Of three recordings of the same candidate one met a narrow lobe: the geometric mean of all is what is said."""
    table, told = TABLE, iter([0.05, 0.02, 0.02, 0.16])  # the first is the look at all candidates
    turned = Choice(turn=90.0)
    monkeypatch.setattr(next_picture, "_told", lambda *_, **__: iter(()))
    monkeypatch.setattr(next_picture, "predictions", lambda *_: {turned: np.array([0.02, next(told)])})
    monkeypatch.setattr(next_picture, "target_center", lambda shape: np.zeros(3))
    scene = SimpleNamespace(renderer=SimpleNamespace(table=table, shape=None, counter=PassCounter()))
    known = Known(np.full(2, 0.5), np.eye(2), ("coat_weight",), Evidence(np.zeros((1, 3, 3)), None, 0.0, 1))
    found = next_picture.next_picture(scene, known, SimpleNamespace(), 0)
    assert found is not None
    width = table["coat_weight"].upper - table["coat_weight"].lower
    assert found.predicted["coat_weight"] == pytest.approx(0.04 * width)
