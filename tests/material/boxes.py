# SPDX-License-Identifier: Apache-2.0
"""Values that hypothesis draws from the box of a parameter table; its faces and corners are as likely as the inside."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from mfo_backend.types.parameter import Parameter, ParameterTable, Value


def component(lower: float, upper: float) -> st.SearchStrategy[float]:
    """One number of the interval."""
    return st.sampled_from([lower, upper]) | st.floats(lower, upper)


def value_of(parameter: Parameter) -> st.SearchStrategy[Value]:
    """A number or a colour."""
    one = component(parameter.lower, parameter.upper)
    return one if parameter.size == 1 else st.tuples(one, one, one)


def box(table: ParameterTable) -> st.SearchStrategy[dict[str, Any]]:
    """A value for every parameter."""
    return st.fixed_dictionaries({p.name: value_of(p) for p in table})
