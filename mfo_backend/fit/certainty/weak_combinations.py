# SPDX-License-Identifier: Apache-2.0
"""Which values can be traded against each other without the picture showing it, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...types.certainty import Certainty, Level, WeakCombination
from ...types.parameter import ParameterTable, Vector
from ..result.outcome import listed
from ..tolerances import TELLING

PART = 0.35  # of the largest one: smaller components of a direction are not named
ALONE = 0.9  # share of one value in a direction that makes it that value's own uncertainty, which has its own column
MOST_DIRECTIONS = 3  # named; no measurement
LEAST_VARIANCE = 1e-8  # of the box; channels of a grey that move as one would have none against each other
# Lobes that differ in how they change towards the silhouette
_GRAZING = ("sheen", "coat", "clearcoat", "specular", "spec_tint", "ior", "eta", "flatness")


def weak_combinations(
    spread: Vector, table: ParameterTable, certainty: dict[str, Certainty], held: Sequence[str]
) -> tuple[WeakCombination, ...]:
    """The least determined directions of several values, from their covariance (k, k) in widths of the box.

    They are eigenvectors of the covariance of the values that are not `held`; a step is one standard deviation.
    Values that the picture does not show at all trade against everything and are left out.
    """
    names = [name for name in table.names if name not in held and certainty[name].level is not Level.NOT_VISIBLE]
    entries = [i for name in names for i in range(*table.slice_of(name).indices(table.length))]
    # what is held does not vary: the others' covariance given its value
    precision = np.linalg.inv(spread + LEAST_VARIANCE * np.eye(len(spread)))[np.ix_(entries, entries)]
    variances, directions = np.linalg.eigh(np.linalg.inv(precision))
    owner = [name for name in names for _ in range(table[name].size)]
    width = table.width[entries]
    found = []
    for variance, direction in list(zip(variances, directions.T, strict=True))[::-1]:
        deviation = float(np.sqrt(max(variance, 0.0)))
        if deviation < TELLING or len(found) == MOST_DIRECTIONS:
            break
        share = {name: sum(direction[i] ** 2 for i, o in enumerate(owner) if o == name) for name in names}
        largest = max(share.values())
        if largest > ALONE:
            continue
        named = [name for name in sorted(names, key=lambda n: -share[n]) if share[name] >= PART**2 * largest]
        if len(named) < 2:
            continue
        step = {}
        for name in named:
            part = [i for i, o in enumerate(owner) if o == name]
            step[name] = float(np.mean(direction[part] * width[part])) * deviation
        sign = 1.0 if step[named[0]] > 0.0 else -1.0
        step = {name: sign * value for name, value in step.items()}
        found.append(WeakCombination(tuple(named), step, _sentence(step, table)))
    return tuple(found)


def _sentence(step: dict[str, float], table: ParameterTable) -> str:
    words = [table[name].label or (name if "/" in name else name.replace("_", " ")) for name in step]
    moves = [
        f"{abs(v):.2g} {'more' if v > 0.0 else 'less'} {word}" for word, v in zip(words, step.values(), strict=True)
    ]
    helps = "a grazing view or another light" if any(name.startswith(_GRAZING) for name in step) else "another light"
    all_of_them = listed(words)
    return (
        f"{all_of_them[:1].upper()}{all_of_them[1:]} can be traded against each other: {listed(moves)} would hardly "
        f"change the picture; {helps} would tell them apart."
    )
