# SPDX-License-Identifier: Apache-2.0
"""What the report says of another material that explains the picture about as well."""

from __future__ import annotations

from mfo_backend.fit.alike.rival_notes import rival_notes
from mfo_backend.fit.squares.problem import Rival
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable(
    Parameter(name, size, 0.0, 1.0, 0.5)
    for name, size in (("base_color", 3), ("roughness", 1), ("coat_weight", 1), ("coat_roughness", 1))
)
FOUND = TABLE.pack({"base_color": (0.5, 0.2, 0.1), "roughness": 0.3, "coat_weight": 0.0, "coat_roughness": 0.1})


def rival(share, **values):
    return Rival(TABLE.pack({**TABLE.unpack(FOUND), **values}), share)


def test_values_that_differ_are_told_the_most_different_first():
    other = rival(0.31, coat_weight=0.48, roughness=0.45, coat_roughness=0.8, base_color=(0.52, 0.2, 0.1))
    assert rival_notes((other,), FOUND, TABLE) == (
        "With a probability of 31 % it is another material: coat_weight 0.48 (not 0), roughness 0.45 (not 0.3).",
    )  # without a coat its roughness says nothing


def test_the_last_of_many_that_look_alike_has_no_probability_of_its_own():
    last = Rival(TABLE.pack({**TABLE.unpack(FOUND), "roughness": 0.9}), 1.0 / 3.0, last=True)
    assert rival_notes((last,), FOUND, TABLE) == (
        "Every material from the result to this one looks the same: roughness 0.9 (not 0.3).",
    )


def test_a_colour_is_told_whole():
    (note,) = rival_notes((rival(0.2, base_color=(0.5, 0.3, 0.1)),), FOUND, TABLE)
    assert note.endswith("base_color (0.5, 0.3, 0.1) (not (0.5, 0.2, 0.1)).")


def test_unlikely_and_similar_ones_are_not_told_and_the_likeliest_comes_first():
    rivals = (
        rival(0.04, roughness=0.9),
        rival(0.9, roughness=0.32),
        rival(0.1, roughness=0.8),
        rival(0.3, roughness=0.6),
    )
    assert [note.split()[4] for note in rival_notes(rivals, FOUND, TABLE)] == ["30", "10"]
