# SPDX-License-Identifier: Apache-2.0
"""Names, sizes and bounds of the values a fit may change, and their packing into one vector."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from .errors import BadInputError

Value = float | tuple[float, ...]
Vector = NDArray[np.float64]  # the values of a table, one after another


def parameter_name(text: str) -> str:
    """The name of a parameter as a user writes it: ``Base Color``, the socket in Blender, is ``base_color``."""
    return "_".join(text.lower().replace("_", " ").split())


def socket_name(parameter: str) -> str:
    """What Blender calls a parameter: ``specular_ior_level`` is Specular IOR Level."""
    return " ".join(word.upper() if word == "ior" else word[:1].upper() + word[1:] for word in parameter.split("_"))


@dataclass(frozen=True)
class Parameter:
    """One value of a material model.

    `size` is 1 for a scalar and 3 for a linear RGB colour. `lower` and `upper` bound every component during a fit.
    Where the renderer's own gradient is not defined up to there, it is that at `slope_upper`. `label` is what its node
    calls it, where that is not the socket of its name. A search from nothing begins at `begin`, or between the bounds.
    Values that are a whole number of `period` apart are the same.
    """

    name: str
    size: int
    lower: float
    upper: float
    default: Value
    slope_upper: float = math.inf
    label: str = ""
    begin: Value | None = None
    period: float = math.inf

    @property
    def shown(self) -> str:
        """What a user calls it."""
        return self.label or (self.name if "/" in self.name else socket_name(self.name))

    def __post_init__(self) -> None:
        if self.size not in (1, 3):
            raise ValueError(f"parameter {self.name!r} has size {self.size}; allowed are 1 (scalar) and 3 (colour)")
        if not self.lower < self.upper:
            raise ValueError(
                f"parameter {self.name!r} has bounds [{self.lower}, {self.upper}]; lower must be below upper"
            )


class ParameterTable(Sequence[Parameter]):
    """An ordered set of parameters and its vector layout, colours taking three consecutive entries."""

    def __init__(self, parameters: Iterable[Parameter]) -> None:
        self._parameters = tuple(parameters)
        names = [p.name for p in self._parameters]
        if len(set(names)) != len(names):
            raise ValueError(f"parameter names repeat in {names}")
        self._by_name = {p.name: p for p in self._parameters}
        offsets = np.cumsum([0, *(p.size for p in self._parameters)])
        self._slices = {p.name: slice(int(a), int(a) + p.size) for p, a in zip(self._parameters, offsets, strict=False)}
        self.length = int(offsets[-1])

    def __len__(self) -> int:
        return len(self._parameters)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self._parameters)

    def __getitem__(self, key):  # type: ignore[no-untyped-def]  # Sequence's overloads plus lookup by name
        return self._by_name[key] if isinstance(key, str) else self._parameters[key]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self._parameters)

    @property
    def slope_upper(self) -> NDArray[np.float64]:
        """The largest values at which the renderer's gradient is defined, shape (length,); infinite without limit."""
        return np.concatenate([np.zeros(0), *(np.full(p.size, p.slope_upper) for p in self._parameters)])

    @property
    def lower(self) -> NDArray[np.float64]:
        """Lower bounds, shape (length,)."""
        return np.concatenate([np.zeros(0), *(np.full(p.size, p.lower) for p in self._parameters)])

    @property
    def upper(self) -> NDArray[np.float64]:
        """Upper bounds, shape (length,)."""
        return np.concatenate([np.zeros(0), *(np.full(p.size, p.upper) for p in self._parameters)])

    @property
    def width(self) -> Vector:
        """How wide the range of each value is, shape (length,)."""
        return self.upper - self.lower

    @property
    def begin(self) -> NDArray[np.float64]:
        """Where a search from nothing begins, shape (length,)."""
        values = {p.name: 0.5 * (p.lower + p.upper) if p.begin is None else p.begin for p in self._parameters}
        return self.pack(values)

    def slice_of(self, name: str) -> slice:
        """Entries of the vector that hold `name`."""
        return self._slices[name]

    def mask_of(self, names: Iterable[str]) -> NDArray[np.bool_]:
        """Which entries of the vector, shape (length,), hold one of `names`; a name that is not here holds none."""
        wanted = set(names)
        return np.concatenate([np.full(p.size, p.name in wanted) for p in self._parameters])

    def select(self, names: Iterable[str]) -> ParameterTable:
        """The named parameters in this table's order.

        Raises
        ------
        BadInputError
            If a name is not in the table, or none is left.
        """
        wanted = list(names)
        unknown = [n for n in wanted if n not in self._by_name]
        if unknown:
            near = [close for name in unknown for close in get_close_matches(parameter_name(name), self.names, n=1)]
            guess = f" (the nearest is {', '.join(near)})" if near else ""
            raise BadInputError(
                f"Unknown parameter {', '.join(map(repr, unknown))}{guess}: this material has {', '.join(self.names)}."
            )
        if not wanted:
            raise BadInputError(f"No parameter is selected: choose at least one of {', '.join(self.names)}.")
        return ParameterTable(p for p in self._parameters if p.name in wanted)

    def pack(self, values: Mapping[str, Value]) -> NDArray[np.float64]:
        """One vector of shape (length,) from a value per name; missing names take their default."""
        parts = [np.broadcast_to(np.asarray(values.get(p.name, p.default), float), (p.size,)) for p in self._parameters]
        return np.concatenate([np.zeros(0), *parts])

    def unpack(self, vector: NDArray[np.float64]) -> dict[str, Value]:
        """The inverse of `pack`: floats for scalars, tuples for colours."""
        values: dict[str, Value] = {}
        for p in self._parameters:
            part = vector[self._slices[p.name]]
            values[p.name] = float(part[0]) if p.size == 1 else tuple(float(v) for v in part)
        return values

    def value(self, vector: Vector, name: str) -> float:
        """The value `name` of a vector; of a colour its first channel."""
        return float(vector[self._slices[name]][0])

    def with_values(self, vector: Vector, **values: Value | Vector) -> Vector:
        """A copy of a vector with these values; a name that is not here changes nothing."""
        changed = vector.copy()
        for name, value in values.items():
            if name in self._slices:
                changed[self._slices[name]] = value
        return changed

    def apart(self, first: Vector, second: Vector) -> float:
        """How far two vectors differ in some value, as a part of its range."""
        return float(np.max(self.away(first, second)))

    def away(self, first: Vector, second: Vector) -> Vector:
        """How far each value of two vectors differs, as a part of its range, shape (length,)."""
        period = np.concatenate([np.zeros(0), *(np.full(p.size, p.period) for p in self._parameters)])
        ways, periodic = np.abs(first - second), np.isfinite(period)
        turns = np.round(ways[periodic] / period[periodic])
        ways[periodic] = np.abs(ways[periodic] - period[periodic] * turns)
        return ways / self.width

    def near(self, vector: Vector, other: Vector) -> Vector:
        """The same values as those of `vector`, which is within the bounds, the nearest to those of `other` there."""
        found = vector.copy()
        for p in self._parameters:
            if math.isfinite(p.period):
                entry = self._slices[p.name]
                value = vector[entry]
                fewest, most = np.ceil((p.lower - value) / p.period), np.floor((p.upper - value) / p.period)
                found[entry] += p.period * np.clip(np.round((other[entry] - value) / p.period), fewest, most)
        return found

    def clip(self, vector: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest vector inside the bounds."""
        return np.clip(vector, self.lower, self.upper)
