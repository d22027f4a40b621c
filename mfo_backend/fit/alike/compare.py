# SPDX-License-Identifier: Apache-2.0
"""Whether a picture tells two materials apart, and what the report says of one that it does not.

The difference of their chi squared is a sum over tiles, d = sum_t (b_t^2 - a_t^2). Its standard deviation is the
scatter of the terms (Q. H. Vuong, "Likelihood Ratio Tests for Model Selection and Non-Nested Hypotheses", 1989).
Chi squared alone does not say how sure d is: both materials may miss the truth, by what renderers differ in or by the
recording's own noise.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from ...material.principled.blender_selection import AMOUNT_OF
from ...types.parameter import ParameterTable, Vector
from ..squares.problem import Problem, Rival
from ..squares.recording_noise import MOST_OWN, rows_of_samples
from ..tolerances import LOUDEST, TELLING
from .unneeded_lobes import is_off

# Of a sentence on another material
TOLD_FROM = 0.05  # its probability; rarer ones still widen the deviations
MOST_TOLD = 4  # values in its sentence; no measurement


@dataclass(frozen=True)
class Comparison:
    """How much more chi squared another material has, the standard deviation of that, and the squared distance of their
    pictures in the same unit.

    `common` is the difference without the few tiles that speak loudest against the other: fireflies are such.
    """

    more: float
    deviation: float
    distance: float
    common: float

    @property
    def inflation(self) -> float:
        """How much larger the noise of the difference is than residuals of pure noise would make it."""
        return max(self.deviation**2 / max(4.0 * self.distance, 1e-12), 1.0)

    @property
    def better(self) -> float:
        """The probability that the other material explains the picture better than the first."""
        return NormalDist().cdf(-self.more / max(self.deviation, 1e-12))


def compare(problem: Problem, first: Vector, other: Vector, model_error: float = 0.0) -> Comparison:
    """Compare two vectors on the tiles of a problem; its residuals of noise at `first` count as one each.

    `model_error` is the least root mean square error of a residual, for problems without noise.
    """
    (rows, own), (other_rows, other_own) = (
        rows_of_samples(problem.evaluate.samples(x), problem.residual) for x in (first, other)
    )
    here, there = rows[:, :, 0], other_rows[:, :, 0]
    squares, away = there**2 - here**2, (there - here) ** 2
    if own is not None and other_own is not None:
        squares -= other_own[:, :, 0] ** 2 - own[:, :, 0] ** 2
        away -= (other_own[:, :, 0] - own[:, :, 0]) ** 2
    cost, more = problem.equations(first).cost, problem.equations(other).cost
    unit = max(cost, 1e-30) / problem.independent
    tiles = squares.mean(1) / (2.0 * len(squares) * unit)
    # own noise is an estimate: far from the material that was recorded it may leave nothing of a distance
    least_away = (1.0 - MOST_OWN) * float(np.mean((there - here) ** 2))
    distance = max(float(away.mean()), least_away) / (2.0 * unit)
    loudest = np.sort(tiles)[-math.ceil(LOUDEST * len(tiles)) :]
    # errors of the picture as large as the model's let the difference of the squares of two others vary by so much
    least = 4.0 * distance * model_error**2 / (2.0 * unit * problem.independent)
    deviation = float(np.sqrt(max(np.sum((tiles - tiles.mean()) ** 2), least)))
    more = (more - cost) / unit
    return Comparison(more, deviation, distance, more - float(np.maximum(loudest, 0.0).sum()))


def rival_notes(
    rivals: Sequence[Rival], x: NDArray[np.float64], table: ParameterTable, unseen: Collection[str] = ()
) -> tuple[str, ...]:
    """A sentence for each likely rival of `x`, likeliest first, with the values that differ most.

    Of values that the picture does not show it is said already that they may be any other.
    """
    notes = []
    for rival in sorted(rivals, key=lambda rival: -rival.share):
        away = table.away(rival.x, x)
        names = [name for name in table.names if name not in unseen and _matters(name, x, rival.x, table)]
        change = {name: float(away[table.slice_of(name)].max()) for name in names}
        told = [name for name in sorted(change, key=lambda n: -change[n]) if change[name] > TELLING][:MOST_TOLD]
        if rival.share < TOLD_FROM or not told:
            continue
        instead = ", ".join(
            f"{table[name].label or name} {_shown(rival.x, name, table)} (not {_shown(x, name, table)})"
            for name in told
        )
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
