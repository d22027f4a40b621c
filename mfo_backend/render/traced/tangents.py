# SPDX-License-Identifier: Apache-2.0
"""The directions in which whole light paths carry derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...types.parameter import ParameterTable

APART = ("base_color", "absorption_color")  # colours of which no channel of the picture looks at another


@dataclass(frozen=True)
class Tangents:
    """The directions in which derivatives are taken: one for each free value, but one for all of a colour whose
    channels each show in their own channel of the picture alone."""

    table: ParameterTable
    entries: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(table: ParameterTable) -> Tangents:
        """Those of a table."""
        entries: list[tuple[int, ...]] = []
        for p in table:
            at = range(*table.slice_of(p.name).indices(table.length))
            entries += [tuple(at)] if p.name in APART else [(k,) for k in at]
        return Tangents(table, tuple(entries))

    def expand(self, columns: NDArray[np.float32]) -> NDArray[np.float32]:
        """(..., 3, 1 + directions) to (..., 3, 1 + values)."""
        if all(len(e) == 1 for e in self.entries):
            return columns
        out = np.zeros((*columns.shape[:-1], 1 + self.table.length), np.float32)
        out[..., 0] = columns[..., 0]
        for direction, entry in enumerate(self.entries):
            for channel, k in enumerate(entry):
                where = slice(None) if len(entry) == 1 else channel
                out[..., where, 1 + k] = columns[..., where, 1 + direction]
        return out
