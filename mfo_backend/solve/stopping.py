# SPDX-License-Identifier: Apache-2.0
"""The paper's stopping rules, one object a stage.

A stage stops when for ten iterations the loss does not change, when for ten iterations the best loss does not improve,
or at the maximum number of iterations. The paper leaves open what counts as a change and as an improvement; here
both are relative, so that the rules mean the same for losses of any size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..types.status import Status


@dataclass(frozen=True)
class StoppingRules:
    """Thresholds of the three rules.

    `change` is the relative step of the loss that counts as one: 1e-6 is what float32 pictures resolve.
    `improvement` is the relative gain of the best loss that counts as one. It is measured from the best loss at the
    last gain that counted, so many small gains add up. 1e-4 in ten iterations is far below what an eye or a new seed
    shows.
    """

    patience: int = 10
    max_iterations: int = 300
    change: float = 1e-6
    improvement: float = 1e-4

    def __post_init__(self) -> None:
        if self.patience < 1 or self.max_iterations < 1:
            raise ValueError(
                f"patience is {self.patience} and max_iterations {self.max_iterations}; both must be 1 or more"
            )
        if not (0.0 <= self.change < 1.0 and 0.0 <= self.improvement < 1.0):
            raise ValueError(f"change is {self.change} and improvement {self.improvement}; both must lie in [0, 1)")


class Stopping:
    """The rules applied to the losses of one stage, in order of evaluation."""

    def __init__(self, rules: StoppingRules) -> None:
        self.rules = rules
        self.iterations = 0
        self.stalled = 0  # iterations since the best loss improved
        self._unchanged = 0
        self._previous = math.nan
        self._anchor = math.inf

    def observe(self, loss: float) -> Status | None:
        """Take the loss of the next iterate; says why to stop, or None. A loss that is not finite never improves."""
        self.iterations += 1
        same = abs(loss - self._previous) <= self.rules.change * abs(self._previous)
        self._unchanged = self._unchanged + 1 if same else 0
        self._previous = loss
        if math.isfinite(loss) and (self._anchor == math.inf or loss < self._anchor * (1.0 - self.rules.improvement)):
            self._anchor = loss
            self.stalled = 0
        else:
            self.stalled += 1
        if self._unchanged >= self.rules.patience:
            return Status.UNCHANGED
        if self.stalled >= self.rules.patience:
            return Status.STALE
        if self.iterations >= self.rules.max_iterations:
            return Status.MAX_ITERATIONS
        return None

    def resume(self) -> None:
        """Give the stage another ten iterations, as after a change of the step size; iterations keep counting."""
        self.stalled = 0
        self._unchanged = 0
        self._previous = math.nan
