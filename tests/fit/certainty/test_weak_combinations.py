# SPDX-License-Identifier: Apache-2.0
"""Directions of known covariances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mfo_backend.fit.certainty.covariance import certainties, standard_deviations
from mfo_backend.fit.certainty.weak_combinations import weak_combinations
from mfo_backend.fit.result.outcome import kept_note
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable(
    [
        Parameter("base_color", 3, 0.0, 1.0, (0.5,) * 3),
        Parameter("roughness", 1, 0.0, 1.0, 0.5),
        Parameter("coat_weight", 1, 0.0, 2.0, 0.0),
        Parameter("metallic", 1, 0.0, 1.0, 0.0),
    ]
)


def combinations(spread, held=()):
    return weak_combinations(spread, TABLE, certainties(standard_deviations(spread, TABLE), TABLE), held)


def along(direction, deviation):
    unit = np.asarray(direction, float) / np.linalg.norm(direction)
    return deviation**2 * np.outer(unit, unit) + 1e-6 * np.eye(6)


def test_names_the_values_that_trade_and_how_far():
    (weak,) = combinations(along([0, 0, 0, 1, -1, 0], 0.1))
    assert weak.parameters == ("roughness", "coat_weight")
    np.testing.assert_allclose([weak.step["roughness"], weak.step["coat_weight"]], [0.0707, -0.1414], rtol=1e-3)
    assert weak.sentence == (
        "Roughness and coat weight can be traded against each other: 0.071 more roughness and 0.14 less coat weight "
        "would hardly change the picture; a grazing view or another light would tell them apart."
    )


def test_a_colour_is_one_value():
    (weak,) = combinations(along([1, 1, 1, 0, 0, -2], 0.12))
    assert set(weak.parameters) == {"base_color", "metallic"}
    assert np.sign(weak.step["base_color"]) == -np.sign(weak.step["metallic"])


def test_says_nothing_of_sure_single_held_and_invisible_values():
    assert combinations(along([0, 0, 0, 1, -1, 0], 0.02)) == ()
    assert combinations(along([0, 0, 0, 1, 0, 0], 0.1)) == ()
    assert combinations(along([0, 0, 0, 1, -1, 0], 0.1), held=("coat_weight",)) == ()
    assert combinations(along([0, 0, 0, 1, -1, 0], 0.9)) == ()  # both not visible
    assert combinations(along([1, -1, 0, 0, 0, 0], 0.1), held=TABLE.names[1:]) == ()  # one colour alone
    assert combinations(along([0, 0, 0, 1, -1, 0], 0.1), held=TABLE.names) == ()


def test_two_values_are_enough():
    (weak,) = combinations(along([0, 0, 0, 1, -1, 0], 0.1), held=("base_color", "metallic"))
    assert set(weak.parameters) == {"roughness", "coat_weight"}


def test_channels_that_move_as_one_are_no_trouble():
    grey = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 1.0])  # whose covariance cannot be inverted
    spread = 0.01 * np.outer(grey, grey) + np.diag([0.0, 0.0, 0.0, 1e-6, 1e-6, 1e-6])
    (weak,) = combinations(spread)
    assert set(weak.parameters) == {"base_color", "metallic"}


def test_values_are_called_as_their_nodes_do():
    labels = {"base_color": "Glossy BSDF/Color", "roughness": "Glossy BSDF/Roughness"}
    table = ParameterTable(
        [*(replace(p, label=labels.get(p.name, "")) for p in TABLE), Parameter("Mix/Factor", 1, 0.0, 1.0, 0.5)]
    )
    direction = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, -2.0])
    spread = 0.01 * np.outer(direction, direction) / 7.0 + 1e-7 * np.eye(7)
    certainty = certainties(standard_deviations(spread, table), table, spread)
    assert certainty["Mix/Factor"].along == ("base_color",)
    assert certainty["Mix/Factor"].shown == ("Glossy BSDF/Color",)
    (weak,) = weak_combinations(spread, table, certainty, ())
    assert weak.sentence.startswith("Mix/Factor and Glossy BSDF/Color can be traded")
    assert kept_note(["base_color"], table) == "The picture does not determine Glossy BSDF/Color: kept as in the scene."
