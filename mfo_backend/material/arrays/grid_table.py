# SPDX-License-Identifier: Apache-2.0
"""Tables on the unit interval, square or cube, read with multilinear interpolation in Dr.Jit arrays."""

from __future__ import annotations

import itertools
import sys
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import dual as dr
from .clamp import saturate
from .own_memory import own_memory

_TABLES: list[GridTable] = []
_OTHERS: list[Any] = []  # buffers of tables that are no grid
MOST_SLICES = 32  # of a table: each is state that a frozen launch carries along


class GridTable:
    """Values on a regular grid whose first and last nodes lie on 0 and 1 of each axis.

    The corners of a cell are stored side by side, which turns 2^d scattered loads into one or two of four numbers.

    Parameters
    ----------
    tables
        Arrays of equal shape (n0, ...), one to three axes. `choice` in a lookup picks one of them.
    """

    def __init__(self, *tables: NDArray[Any]) -> None:
        self._tables = tables
        self._slices: dict[float, GridTable] = {}
        self.shape = tables[0].shape
        self.dimensions = len(self.shape)
        corners = [
            [table[tuple(slice(c, n - 1 + c) for c, n in zip(corner, self.shape, strict=True))] for table in tables]
            for corner in itertools.product((0, 1), repeat=self.dimensions)
        ]
        self.cells = int(np.prod([n - 1 for n in self.shape]))
        # (tables * cells, corners): the last axis of the grid varies fastest among the corners
        self.corners = np.moveaxis(np.asarray(corners, np.float64), 0, -1).reshape(-1, 2**self.dimensions)
        self._buffers: dict[type, Any] = {}
        _TABLES.append(self)

    def buffer(self, float_type: type) -> Any:
        """The corners as an evaluated array of `float_type`, made once."""
        if float_type not in self._buffers:
            self._buffers[float_type] = own_memory(self.corners.ravel(), float_type)
        return self._buffers[float_type]

    def __call__(self, *places: Any, choice: Any = None) -> Any:
        """The value at `places`, one array in [0, 1] per axis; differentiable in them, constant outside."""
        float_type = dr.array_type(places[0])
        fixed = _literal(places[-1]) if self.dimensions > 1 else None
        if fixed is not None and (fixed in self._slices or len(self._slices) < MOST_SLICES):
            return self._slice(fixed)(*places[:-1], choice=choice)
        index_type = dr.uint32_array_t(float_type)
        index = index_type(0)
        fractions = []
        for place, count in zip(places, self.shape, strict=True):
            scaled = saturate(place) * (count - 1)
            node = dr.minimum(index_type(dr.detach(scaled)), count - 2)
            fractions.append(scaled - float_type(node))
            index = index * (count - 1) + node
        if choice is not None:
            index += choice * self.cells
        values = self._corners_at(index, float_type)
        for fraction in reversed(fractions):
            values = [fraction * (b - a) + a for a, b in zip(values[::2], values[1::2], strict=True)]
        return values[0]

    def _slice(self, place: float) -> GridTable:
        """The table at a fixed place of its last axis: half as many numbers to read, from a table that fits a cache."""
        if place not in self._slices:
            scaled = min(max(place, 0.0), 1.0) * (self.shape[-1] - 1)
            node = min(int(scaled), self.shape[-1] - 2)
            share = scaled - node
            cut = (np.asarray(t, np.float64)[..., node : node + 2] @ np.array([1 - share, share]) for t in self._tables)
            self._slices[place] = GridTable(*cut)
        return self._slices[place]

    def _corners_at(self, index: Any, float_type: type) -> list[Any]:
        count = 2**self.dimensions
        width = min(count, 4)
        suffix = "f64" if dr.type_v(float_type) == dr.VarType.Float64 else "f"
        packet = getattr(sys.modules[float_type.__module__], f"Array{width}{suffix}")
        buffer, parts = self.buffer(float_type), count // width
        packets = [dr.gather(packet, buffer, index * parts + part) for part in range(parts)]
        return [value for values in packets for value in values]


def _literal(place: Any) -> float | None:
    """The value of `place` where the compiler knows it and nothing differentiates it."""
    array = dr.value_of(place)
    known = dr.is_jit_v(array) and array.state == dr.VarState.Literal and not dr.varies(place)
    return float(array[0]) if known and dr.width(array) == 1 else None


def other_buffer(numbers: NDArray[Any], float_type: type) -> Any:
    """The numbers of a table that is no grid and lives as long as the process, as an evaluated array."""
    _OTHERS.append(own_memory(numbers, float_type))
    return _OTHERS[-1]


def loaded_buffers() -> list[Any]:
    """Buffers of all tables read so far: what a frozen launch has to name as its state."""
    return [*_OTHERS, *(buffer for table in _TABLES for buffer in table._buffers.values())]


@cache
def cycles_table(*names: str, plane: int | None = None) -> GridTable:
    """Tables measured in Cycles (`tools/make_tables.py`): `names` of equal shape, or one `plane` of a stack of them."""
    archive = resources.files("mfo_backend.material") / "tables" / "cycles_albedo.npz"
    with archive.open("rb") as file, np.load(file, allow_pickle=False) as data:
        return GridTable(*(data[name] if plane is None else data[name][plane] for name in names))
