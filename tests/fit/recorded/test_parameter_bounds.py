# SPDX-License-Identifier: Apache-2.0
"""Limits of a user inside those of the material model."""

from __future__ import annotations

import math
from typing import Any

import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.parameter import Parameter, ParameterTable
from mfo_backend.types.parameter_bounds import narrowed

TABLE = ParameterTable([Parameter("roughness", 1, 0.04, 1.0, 0.5), Parameter("base_color", 3, 0.001, 0.999, 0.8)])


def test_the_intersection_holds() -> None:
    table = narrowed(TABLE, {"roughness": (0.0, 0.25), "base_color": (0.5, 2.0), "coat": (0.0, 0.1)})
    assert [(p.name, p.lower, p.upper) for p in table] == [("roughness", 0.04, 0.25), ("base_color", 0.5, 0.999)]
    assert table.clip(TABLE.pack({})).tolist() == [0.25, 0.8, 0.8, 0.8]
    assert narrowed(TABLE, {}).names == TABLE.names


@pytest.mark.parametrize("pair", [(1.5, 2.0), (0.0, 0.04), (0.5, 0.50001)])
def test_nothing_left(pair: tuple[float, float]) -> None:
    with pytest.raises(BadInputError, match=r"leave nothing of its range \[0\.04, 1\]"):
        narrowed(TABLE, {"roughness": pair})


@pytest.mark.parametrize(
    "bounds",
    [3, [], {"a": 1}, {"a": [1]}, {"a": [0.5, 0.5]}, {"a": [1, 0]}, {"a": [0, math.inf]}, {"a": [math.nan, 1]},
     {"a": ["0", "1"]}, {"a": [True, 2]}],
)  # fmt: skip
def test_what_is_no_bound(bounds: Any) -> None:
    with pytest.raises(BadInputError, match="bounds"):
        FitSettings.from_request({"bounds": bounds})


def test_settings_take_them() -> None:
    assert FitSettings.from_request({"bounds": {"roughness": [0.2, 1]}}).bounds == {"roughness": (0.2, 1.0)}
    assert FitSettings().bounds == {}
