# SPDX-License-Identifier: Apache-2.0
"""Levenberg-Marquardt inside a box, on normal equations in float64.

Damping after H. B. Nielsen, "Damping Parameter in Marquardt's Method" (IMM-REP-1999-05); scaling by the largest
diagonal seen after J. J. More, "The Levenberg-Marquardt Algorithm" (1978). Steps are exact minima of the damped
quadratic in the box, so a solution on a bound is reached like any other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .box_quadratic import minimise_in_box

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class NormalEquations:
    """Half the sum of squared residuals, its gradient (k,) and the Gauss-Newton matrix (k, k)."""

    cost: float
    gradient: Vector
    hessian: Vector

    @property
    def finite(self) -> bool:
        """Whether a step may be built on these numbers."""
        return bool(np.isfinite(self.cost) and np.isfinite(self.gradient).all() and np.isfinite(self.hessian).all())


Residuals = Callable[[Vector], NormalEquations]
TRIED = 3  # evaluations after which the quadratic is believed when it promises little
FALSE_PROMISE = 10.0  # times what noise hides: a rejected step has shown that the quadratic says no more


@dataclass(frozen=True)
class SolveLimits:
    """When to stop.

    `cost_change` is relative, `step` is relative to the width of the box, `cost_floor` is absolute. `damping` is the
    first one; 1e-2 trusts a Gauss-Newton step but keeps weak directions from running away. `known` and `wanted` are
    costs, of another solution and of one that would be better: a solve that has come below the first, and whose
    quadratic promises no less than the second, ends there. `unseen` is the relative change of a cost that noise hides:
    a solve ends where its undamped quadratic promises less, or `FALSE_PROMISE` times that after a rejected step.
    """

    evaluations: int = 60
    cost_change: float = 1e-6
    step: float = 1e-6
    cost_floor: float = 0.0
    damping: float = 1e-2
    known: float = 0.0
    wanted: float = 0.0
    unseen: float = 0.0


@dataclass(frozen=True)
class Solution:
    """The best point found, its normal equations, and the cost of each evaluation (inf where it was not finite).

    `converged` says that more evaluations would not have been worth it.
    """

    x: Vector
    equations: NormalEquations
    costs: tuple[float, ...]
    converged: bool


def solve_bounded(
    residuals: Residuals,
    start: Vector,
    lower: Vector,
    upper: Vector,
    limits: SolveLimits = SolveLimits(),
    should_stop: Callable[[], bool] = lambda: False,
) -> Solution:
    """Minimise half the sum of squares with lower <= x <= upper from `start`.

    A trial with non-finite numbers is a rejected step. The cost of the result is never above the cost of the start.

    Raises
    ------
    ValueError
        If the residuals are not finite at the start.
    """
    x = np.clip(np.asarray(start, np.float64), lower, upper)
    here = residuals(x)
    if not here.finite:
        raise ValueError("The residuals are not finite at the start: the solver needs a start where they are.")
    costs = [here.cost]
    damping, growth = limits.damping, 2.0
    scale = np.zeros_like(x)
    width = np.where(upper > lower, upper - lower, 1.0)  # equal bounds hold a value where it is
    converged = rejected = False
    while len(costs) < limits.evaluations and not should_stop():
        diagonal = np.diag(here.hessian)
        # a column without effect still needs a positive entry
        scale = np.maximum(scale, np.maximum(diagonal, 1e-12 * max(diagonal.max(), 1e-300)))
        damped = here.hessian + damping * np.diag(scale)
        try:
            step = minimise_in_box(damped, here.gradient, lower - x, upper - x)
        except np.linalg.LinAlgError:
            damping, growth = damping * growth, growth * 2.0
            if damping > 1e12:
                break
            continue
        predicted = -(here.gradient @ step + 0.5 * step @ here.hessian @ step)
        small = np.max(np.abs(step) / width) < limits.step
        if here.cost <= limits.cost_floor or small or predicted <= limits.cost_change * here.cost * 1e-2:
            converged = True
            break
        tried = len(costs) >= TRIED and here.cost <= limits.known
        unseen = limits.unseen * here.cost * (FALSE_PROMISE if rejected else 1.0)
        if tried or unseen:
            rise = step_in_box(here, x, lower, upper)[1]
            if -rise < unseen or (tried and here.cost + rise > limits.wanted):
                converged = True
                break
        trial = residuals(x + step)
        costs.append(trial.cost if trial.finite else np.inf)
        gain = (here.cost - trial.cost) / predicted if trial.finite else -1.0
        rejected = gain <= 1e-4
        if not rejected:
            change = here.cost - trial.cost
            x, here = x + step, trial
            damping *= max(1.0 / 5.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            damping, growth = max(damping, 1e-10), 2.0
            if change <= limits.cost_change * here.cost:
                converged = True
                break
        else:
            damping, growth = damping * growth, growth * 2.0
            if damping > 1e12:
                break
    return Solution(x, here, tuple(costs), converged)


def step_in_box(equations: NormalEquations, x: Vector, lower: Vector, upper: Vector) -> tuple[Vector, float]:
    """The step from `x` to the lowest cost in the box by the undamped quadratic, and how much the cost rises by it.

    `x` may lie outside where the box holds a value still: that goes there.
    """
    hessian = equations.hessian + 1e-9 * np.diag(equations.hessian).max() * np.eye(len(x))
    step = minimise_in_box(hessian, equations.gradient, lower - x, upper - x)
    return step, float(equations.gradient @ step + 0.5 * step @ hessian @ step)
