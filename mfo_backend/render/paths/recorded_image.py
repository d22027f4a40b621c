# SPDX-License-Identifier: Apache-2.0
"""Pictures of recorded paths, with what two independent samples of the light say about the recording's own noise."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Rows = NDArray[np.float32]
# Answers, each a few megabytes at most: a solve looks back no further than to its best point, and the next one, or a
# comparison, to where a solve of `plans.NEAR_EVALUATIONS` began. With 8 a fit made 8 to 23 evaluations twice
# (docs/notebook/graph_values.md)
RECALLED = 16


@dataclass(frozen=True)
class TwoSamples:
    """Image and derivatives of groups, both (g, 3, 1 + K): the mean of two samples of the light and half their
    difference, whose expectation is 0 and whose products are those of the mean's noise; None for a single sample."""

    mean: Rows
    half_difference: Rows | None

    @staticmethod
    def of(samples: Rows, constant: Rows, constant_difference: Rows | None = None) -> TwoSamples:
        """That of one or two samples (s, g, 3, 1 + K) without the `constant` part of the image (g, 3).

        `constant_difference` is half the difference of two samples of that part.
        """
        difference = None
        if len(samples) == 2:
            first, second = samples
            mean, difference = 0.5 * (first + second), 0.5 * (first - second)
        else:
            (mean,) = samples
        mean[:, :, 0] += constant
        if difference is not None and constant_difference is not None:
            difference[:, :, 0] += constant_difference
        return TwoSamples(mean, difference)

    def averaged(self, average: Callable[[Rows], Rows]) -> TwoSamples:
        """That of groups from that of their pixels, by a function that is linear."""
        return TwoSamples(average(self.mean), None if self.half_difference is None else average(self.half_difference))


class RecordedImage:
    """A function of a vector that is not asked twice for the same: it keeps the last `recalled` answers.

    Noise, weights, certainty and the next solve all begin where the last solve ended.
    """

    def __init__(self, evaluate: Callable[[Vector], TwoSamples], recalled: int = 1) -> None:
        self._evaluate, self._recalled = evaluate, recalled
        self._known: OrderedDict[bytes, TwoSamples] = OrderedDict()

    def __call__(self, x: Vector) -> Rows:
        """Image and Jacobian (g, 3, 1 + K) at `x`; they cannot be written to."""
        return self.samples(x).mean

    def samples(self, x: Vector) -> TwoSamples:
        """The same with its own noise."""
        key = x.tobytes()
        if key not in self._known:
            self.note(x, self._evaluate(x))
        self._known.move_to_end(key)
        return self._known[key]

    def glance(self, x: Vector) -> Rows:
        """The image at `x`; what is kept stays as it is, so that a look by the clock changes nothing afterwards."""
        known = self._known.get(x.tobytes())
        return (self._evaluate(x) if known is None else known).mean

    def note(self, x: Vector, answer: TwoSamples) -> None:
        """Take over an answer that was found in another way."""
        for rows in (answer.mean, answer.half_difference):
            if rows is not None:
                rows.flags.writeable = False
        self._known[x.tobytes()] = answer
        if len(self._known) > self._recalled:
            self._known.popitem(last=False)
