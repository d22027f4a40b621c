# SPDX-License-Identifier: Apache-2.0
"""The smallest value of a convex quadratic inside a box."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def minimise_in_box(hessian: Vector, gradient: Vector, lower: Vector, upper: Vector) -> Vector:
    """The s with lower <= s <= upper that minimises gradient . s + s . hessian s / 2.

    Primal active-set method (J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., algorithm 16.3), exact for a
    positive definite `hessian`; meant for some twenty unknowns. 0 has to lie inside the box, but where that has
    no width.

    Raises
    ------
    numpy.linalg.LinAlgError
        If `hessian` is not positive definite.
    """
    size = len(gradient)
    s = np.clip(np.zeros(size), lower, upper)
    held = lower >= upper
    # a bound that the first descent direction would cross at once starts active
    active = held | ((s <= lower) & (gradient > 0.0)) | ((s >= upper) & (gradient < 0.0))
    for _ in range(10 * size + 10):
        free = ~active
        direction = np.zeros(size)
        if free.any():
            residual = gradient + hessian @ s
            block = hessian[np.ix_(free, free)]
            # Cholesky proves that the block is positive definite; solving by it saves nothing at this size
            np.linalg.cholesky(block)
            direction[free] = np.linalg.solve(block, -residual[free])
        room = np.full(size, np.inf)
        down, up = direction < 0.0, direction > 0.0
        room[down] = (lower - s)[down] / direction[down]
        room[up] = (upper - s)[up] / direction[up]
        blocking = int(np.argmin(room))
        if room[blocking] < 1.0:
            s = np.clip(s + max(room[blocking], 0.0) * direction, lower, upper)
            s[blocking] = lower[blocking] if down[blocking] else upper[blocking]
            active[blocking] = True
            continue
        s = np.clip(s + direction, lower, upper)
        slope = gradient + hessian @ s
        # multipliers of the active bounds; a negative one wants to leave its bound
        multiplier = np.where(s <= lower, slope, -slope)
        scale = np.abs(gradient).max(initial=0.0) * 1e-12
        wants_out = active & ~held & (multiplier < -scale)
        if not wants_out.any():
            break
        active[int(np.argmin(np.where(wants_out, multiplier, np.inf)))] = False
    return s
