# SPDX-License-Identifier: Apache-2.0
"""The vector layout of a table of parameters."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.types.errors import BadInputError
from mfo_backend.types.parameter import Parameter, ParameterTable, parameter_name

TABLE = ParameterTable([Parameter("base_color", 3, 0.0, 1.0, (0.8,) * 3), Parameter("roughness", 1, 0.05, 1.0, 0.5)])


@pytest.mark.parametrize(
    ("names", "expected"),
    [((), [0, 0, 0, 0]), (["roughness"], [0, 0, 0, 1]), (("base_color", "ior"), [1, 1, 1, 0])],
)
def test_a_mask_holds_all_entries_of_its_names(names, expected):
    mask = TABLE.mask_of(names)
    assert mask.dtype == bool
    np.testing.assert_array_equal(mask, expected)
    for name in TABLE.names:
        assert mask[TABLE.slice_of(name)].all() == (name in names)


@pytest.mark.parametrize("text", ["Base Color", "base_color", " BASE color ", "Base_Color"])
def test_names_as_users_write_them(text):
    assert parameter_name(text) == "base_color"


TURNING = ParameterTable([*TABLE, Parameter("anisotropic_rotation", 1, 0.0, 1.0, 0.0, period=0.5)])


@pytest.mark.parametrize(
    ("turn", "other", "nearest", "apart"),
    [
        (0.5, 0.0, 0.0, 0.0),
        (0.6, 0.05, 0.1, 0.05),
        (0.1, 0.9, 0.6, 0.2),
        (0.98, 0.02, 0.48, 0.04),
        (0.3, 0.3, 0.3, 0.0),
    ],
)
def test_values_a_period_apart_are_one(turn, other, nearest, apart):
    first, second = (TURNING.pack({"roughness": 0.2, "anisotropic_rotation": value}) for value in (turn, other))
    found = TURNING.near(first, second)
    assert TURNING.value(found, "anisotropic_rotation") == pytest.approx(nearest)
    np.testing.assert_array_equal(found[:4], first[:4])
    assert TURNING.apart(first, second) == TURNING.apart(second, first) == pytest.approx(apart)


def test_a_typing_error_gets_the_nearest_name():
    with pytest.raises(
        BadInputError, match=r"Unknown parameter 'Rougness' \(the nearest is roughness\): this material"
    ):
        TABLE.select(["Rougness"])
    with pytest.raises(BadInputError, match=r"Unknown parameter 'gloss': this material has base_color, roughness"):
        TABLE.select(["gloss"])
