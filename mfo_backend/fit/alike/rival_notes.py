# SPDX-License-Identifier: Apache-2.0
"""Sentences on other materials that explain the picture about as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...material.blender_selection import AMOUNT_OF
from ...types.parameter import ParameterTable
from ..squares.problem import Rival
from .unneeded_lobes import is_off

TOLD_FROM = 0.05  # probability; rarer ones still widen the deviations
SEEN_CHANGE = 0.05  # of a value's range
MOST_VALUES = 4


def rival_notes(rivals: Sequence[Rival], x: NDArray[np.float64], table: ParameterTable) -> tuple[str, ...]:
    """A sentence for each likely rival of `x`, likeliest first, with the values that differ most."""
    notes = []
    for rival in sorted(rivals, key=lambda rival: -rival.share):
        away = np.abs(rival.x - x) / (table.upper - table.lower)
        names = [name for name in table.names if _matters(name, x, rival.x, table)]
        change = {name: float(away[table.slice_of(name)].max()) for name in names}
        told = [name for name in sorted(change, key=lambda n: -change[n]) if change[name] > SEEN_CHANGE][:MOST_VALUES]
        if rival.share < TOLD_FROM or not told:
            continue
        instead = ", ".join(f"{name} {_shown(rival.x, name, table)} (not {_shown(x, name, table)})" for name in told)
        if rival.last:
            notes.append(f"Every material from the result to this one looks the same: {instead}.")
        else:
            notes.append(f"With a probability of {100 * rival.share:.0f} % it is another material: {instead}.")
    return tuple(notes)


def _matters(name: str, x: NDArray[np.float64], other: NDArray[np.float64], table: ParameterTable) -> bool:
    """Whether both materials have the lobe that this value is a detail of."""
    amount = AMOUNT_OF.get(name)
    return amount not in table.names or not any(is_off(amount, vector, table) for vector in (x, other))


def _shown(x: NDArray[np.float64], name: str, table: ParameterTable) -> str:
    values = [f"{value:.2g}" for value in x[table.slice_of(name)]]
    return values[0] if len(values) == 1 else f"({', '.join(values)})"
