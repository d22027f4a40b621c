# SPDX-License-Identifier: Apache-2.0
"""Adam's rate inside one stage.

With a constant rate near a minimum Adam walks in steps of about that rate, the best loss stops improving, and the
paper's rule of ten stale iterations ends the stage wherever it happens to be, often at its very start under FLIP. The
decaying schedule answers each such stall by going back to the best values with a third of the rate and fresh moments;
the stage ends by the same rule at the last level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Schedule:
    """Rates a stage goes through: `levels` of them, each `factor` of the one before."""

    levels: int = 1
    factor: float = 1.0 / 3.0

    def rate(self, first: NDArray[np.float64], level: int) -> NDArray[np.float64]:
        """The rate at `level`, counted from 0."""
        return first * self.factor**level


SCHEDULES = {"constant": Schedule(levels=1), "decay": Schedule(levels=4)}
