# SPDX-License-Identifier: Apache-2.0
"""Which of several ends of a fit on traced paths is the best, by paths that none of them has seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...render.camera.primary_rays import TILE
from ...types.parameter import Vector
from ..plans import TransmissionPlan
from ..random_streams import Stream
from .pictures import TracedTiles

# Times that paths are traced, at most; more only while it is open which end is better
GUARD_PARTS = Stream.CHOOSE.value.length


def choose_end(
    pictures: TracedTiles,
    candidates: Sequence[Vector],
    plan: TransmissionPlan,
    seed: int,
    stream: Stream,
    first: int = 0,
) -> int:
    """The first candidate, unless a later one is better by two standard errors on paths that none has seen.

    Nor does a third take the place of that one unless it is better than it by as much. The paths are those of `stream`
    from the number `first` on.
    """
    if len(candidates) == 1:
        return 0
    xs, samples, most = np.array(candidates), plan.guard_samples, plan.polish_pixels
    counts = pictures.counts
    if counts is not None:
        samples = counts.count
        most = min(most, plan.counted_paths // (len(candidates) * samples))
    tiles = pictures.tiles(TILE, most)
    parts: list[Vector] = []
    chosen = 0
    for part in range(GUARD_PARTS):
        rows = pictures.halves(tiles, xs, seed=stream.seed(seed, first + part), samples=samples, jacobian=False)
        if pictures.should_stop():
            return 0
        parts.append(np.array([(a[:, 0].astype(np.float64) * b[:, 0]).reshape(-1, 3).mean(axis=1) for a, b in rows]))
        costs, chosen = np.mean(parts, axis=0), 0
        for other in range(1, len(xs)):
            mean, error = _gain(costs[chosen], costs[other])
            chosen = other if mean > 2.0 * error else chosen
        # more paths only where another looks better and it is not sure
        left = [_gain(costs[chosen], cost) for cost in costs]
        if not any(error < mean <= 2.0 * error for mean, error in left):
            break
    return chosen


def _gain(costs: Vector, other: Vector) -> tuple[float, float]:
    """How much less the `other` costs in the mean of the tiles, and the standard error of that."""
    gain = costs - other
    return float(gain.mean()), float(gain.std() / np.sqrt(len(gain)))
