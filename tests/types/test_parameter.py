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


def test_a_typing_error_gets_the_nearest_name():
    with pytest.raises(
        BadInputError, match=r"Unknown parameter 'Rougness' \(the nearest is roughness\): this material"
    ):
        TABLE.select(["Rougness"])
    with pytest.raises(BadInputError, match=r"Unknown parameter 'gloss': this material has base_color, roughness"):
        TABLE.select(["gloss"])
