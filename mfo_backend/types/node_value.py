# SPDX-License-Identifier: Apache-2.0
"""Values inside the node graph of a material: numbers and colours that are no sockets of its shader."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .parameter import Parameter, ParameterTable, Value


@dataclass(frozen=True)
class NodeValue:
    """One value of a graph.

    Attributes
    ----------
    name
        What a user calls it, ``"Color Ramp/Stop 0"``.
    value
        A number, or a colour as linear Rec.709, as the file has it.
    lower, upper
        Bounds of every component.
    logarithmic
        Whether it counts by factors, as the scale of a texture does.
    step
        The difference that its derivative is taken over.
    scanned
        Whether it has many minima, so that values all over its range are tried first.
    sockets
        Names of the sockets of the shader that it reaches.
    place
        Where it is in the file, for those who evaluate it.
    """

    name: str
    value: Value
    lower: float
    upper: float
    logarithmic: bool
    step: float
    scanned: bool
    sockets: tuple[str, ...]
    place: Mapping[str, Any]

    @property
    def parameter(self) -> Parameter:
        """The value as a fit changes it."""
        size = len(self.value) if isinstance(self.value, tuple) else 1
        return Parameter(self.name, size, self.lower, self.upper, self.value)


def table_of(values: Sequence[NodeValue]) -> ParameterTable:
    """The values as a fit changes them, in their order."""
    return ParameterTable(value.parameter for value in values)
