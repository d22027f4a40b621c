# SPDX-License-Identifier: Apache-2.0
"""Limits that a user sets on the values of a fit, inside those of the material model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from .errors import BadInputError
from .parameter import ParameterTable, parameter_name

_NARROWEST = 1e-4  # share of a parameter's range; a solver needs some room, and a value to hold is not to be fitted


def checked_bounds(data: Any) -> dict[str, tuple[float, float]]:
    """Bounds from JSON, ``{"roughness": [0.2, 0.6]}``.

    Raises
    ------
    BadInputError
        If a bound is no pair of finite numbers, the lower one first.
    """
    if not isinstance(data, Mapping):
        raise BadInputError(f"Fit setting 'bounds' is {str(data)[:60]!r}: give an object of name and [lower, upper].")
    bounds = {}
    for name, pair in data.items():
        numbers = pair if isinstance(pair, (list, tuple)) else ()
        if len(numbers) != 2 or any(isinstance(n, bool) or not isinstance(n, (int, float)) for n in numbers):
            raise BadInputError(f"The bounds of {name!r} are {str(pair)[:60]}: give [lower, upper].")
        lower, upper = map(float, numbers)
        if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
            raise BadInputError(
                f"The bounds of {name!r} are [{lower:g}, {upper:g}]: the lower must be below the upper."
            )
        bounds[parameter_name(str(name))] = (lower, upper)
    return bounds


def narrowed(table: ParameterTable, bounds: Mapping[str, tuple[float, float]]) -> ParameterTable:
    """The table with the bounds of its parameters cut to `bounds`; names it does not have are not looked at.

    Raises
    ------
    BadInputError
        If nothing of a parameter's own range is left.
    """
    kept = []
    for parameter in table:
        lower, upper = bounds.get(parameter_name(parameter.name), (parameter.lower, parameter.upper))
        low, high = max(lower, parameter.lower), min(upper, parameter.upper)
        if high - low < _NARROWEST * (parameter.upper - parameter.lower):
            raise BadInputError(
                f"The bounds [{lower:g}, {upper:g}] of {parameter.name!r} leave nothing of its range "
                f"[{parameter.lower:g}, {parameter.upper:g}]: widen them, or leave the parameter out."
            )
        kept.append(replace(parameter, lower=low, upper=high))
    return ParameterTable(kept)
