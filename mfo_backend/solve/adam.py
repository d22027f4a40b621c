# SPDX-License-Identifier: Apache-2.0
"""Adam on a bounded vector.

References
----------
Kingma and Ba 2015, "Adam: A Method for Stochastic Optimization", Algorithm 1 (with the bias correction of its steps
10 to 12), followed by a projection onto the box.
"""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]


@dataclass
class Adam:
    """The optimiser's state. `rates` is one number or one per entry, in units of the vector."""

    lower: Vector
    upper: Vector
    rates: InitVar[ArrayLike] = 0.02
    beta_1: float = 0.9
    beta_2: float = 0.999
    epsilon: float = 1e-12  # below the usual 1e-8, which is as large as the slopes of the MSE of a dark picture
    steps: int = field(default=0, init=False)
    rate: Vector = field(init=False)
    _mean: Vector = field(init=False, repr=False)
    _square: Vector = field(init=False, repr=False)

    def __post_init__(self, rates: ArrayLike) -> None:
        self.rate = np.broadcast_to(np.asarray(rates, dtype=np.float64), self.lower.shape)
        if not (np.isfinite(self.rate).all() and (self.rate > 0.0).all()):
            raise ValueError(f"rate is {self.rate}; every rate must be finite and above 0")
        self.reset()

    def reset(self) -> None:
        """Forget the moments: the next step is that of a new optimisation."""
        self.steps = 0
        self._mean = np.zeros_like(self.lower)
        self._square = np.zeros_like(self.lower)

    def step(self, vector: Vector, gradient: Vector) -> Vector:
        """The next vector, inside the bounds.

        Raises
        ------
        ValueError
            If the gradient is not finite: one such step would spoil the moments for good.
        """
        if not np.isfinite(gradient).all():
            raise ValueError(f"gradient is {gradient}; every entry must be finite")
        self.steps += 1
        self._mean = self.beta_1 * self._mean + (1.0 - self.beta_1) * gradient
        self._square = self.beta_2 * self._square + (1.0 - self.beta_2) * gradient**2
        mean = self._mean / (1.0 - self.beta_1**self.steps)
        square = self._square / (1.0 - self.beta_2**self.steps)
        return np.clip(vector - self.rate * mean / (np.sqrt(square) + self.epsilon), self.lower, self.upper)
