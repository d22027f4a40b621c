# SPDX-License-Identifier: Apache-2.0
"""A function of a vector that is not asked twice for the same: noise, weights, certainty and the next solve all begin
where the last solve ended."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from .residuals import ImageAndJacobian

RECALLED = 8  # answers, each a few megabytes at most; a solve looks back no further than to its best point


class Remembered:
    """`evaluate`, with its last `RECALLED` answers kept; they cannot be written to."""

    def __init__(self, evaluate: ImageAndJacobian) -> None:
        self._evaluate = evaluate
        self._known: OrderedDict[bytes, NDArray[np.float32]] = OrderedDict()

    def __call__(self, x: NDArray[np.float64]) -> NDArray[np.float32]:
        """Image and Jacobian at `x`."""
        key = x.tobytes()
        if key not in self._known:
            self.note(x, self._evaluate(x))
        self._known.move_to_end(key)
        return self._known[key]

    def note(self, x: NDArray[np.float64], answer: NDArray[np.float32]) -> None:
        """Take over an answer that was found in another way."""
        answer.flags.writeable = False
        self._known[x.tobytes()] = answer
        if len(self._known) > RECALLED:
            self._known.popitem(last=False)
