# SPDX-License-Identifier: Apache-2.0
"""Least squares without what a recording's own noise adds to squares of residuals and of their derivatives.

That noise depends on the material: a rougher one has less, so plain squares prefer it, and noise in derivatives makes
values look better determined than they are. A product of two independent samples a and b of the light has no such part;
with the mean m and half the difference d of their rows, a b = m^2 - d^2 (docs/method/recorded_paths.md).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...render.paths.recorded_image import TwoSamples
from ...solve.bounded_least_squares import NormalEquations
from ...types.parameter import Vector
from .residuals import Residual, gram_of, rows_and_slope, sloped

# Of the own noise where a problem was made: no more than this is taken away. Far from the material that was recorded
# few lanes carry the light, and what they say of their noise is noise itself.
MOST_TAKEN = 3.0
MOST_OWN = 0.95  # of the cost, and of the square of a derivative in any direction: both are estimates


def rows_of_samples(two: TwoSamples, residual: Residual) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Values and derivatives (g, 3, 1 + k) of the residual at the mean, and half their difference to first order."""
    rows, slope = rows_and_slope(two.mean, residual)
    return rows, None if two.half_difference is None else sloped(two.half_difference, slope)


def unbiased_equations(
    samples: Callable[[Vector], TwoSamples], residual: Residual, near: Vector
) -> Callable[[Vector], NormalEquations]:
    """The least-squares problem of `residual` without own noise, per residual; sums in float64.

    The cost keeps the own noise it has at `near`, so that it stays positive and ratios of costs mean what they would
    with it.
    """
    _, there = rows_of_samples(samples(near), residual)
    own_near = 0.0 if there is None else float(np.mean(np.square(there[:, :, 0])))

    def at(x: Vector) -> NormalEquations:
        rows, half_difference = rows_of_samples(samples(x), residual)
        gram = gram_of(rows)
        gradient, hessian = gram[1:, 0], gram[1:, 1:]
        if half_difference is None or not np.isfinite(gram).all():
            return NormalEquations(0.5 * float(gram[0, 0]), gradient, hessian)
        own = gram_of(half_difference)
        taken = min(float(own[0, 0]), MOST_TAKEN * own_near) - own_near
        cost = 0.5 * (float(gram[0, 0]) - min(taken, MOST_OWN * float(gram[0, 0])))
        if own[0, 0] > MOST_TAKEN * own_near:
            return NormalEquations(cost, gradient, hessian)
        return NormalEquations(cost, gradient - own[1:, 0], without_own_noise(hessian, own[1:, 1:]))

    return at


def without_own_noise(gram: Vector, own: Vector) -> Vector:
    """`gram` - `own`, both (k, k), but in no direction less than 1 - `MOST_OWN` of `gram`."""
    ridge = 1e-12 * max(float(np.diag(gram).max()), 1e-300)
    root = np.linalg.cholesky(gram + ridge * np.eye(len(gram)))
    inverse = np.linalg.inv(root)
    shares, directions = np.linalg.eigh(inverse @ own @ inverse.T)
    stretched = root @ directions
    return (stretched * (1.0 - np.minimum(shares, MOST_OWN))) @ stretched.T
