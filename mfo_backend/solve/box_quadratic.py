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
    s = np.minimum(np.maximum(0.0, lower), upper)
    held = lower >= upper
    # a bound that the first descent direction would cross at once starts active
    active = held | ((s <= lower) & (gradient > 0.0)) | ((s >= upper) & (gradient < 0.0))
    scale = np.abs(gradient).max(initial=0.0) * 1e-12
    unit = np.eye(size)
    # proves that this is positive definite, and with it every block; solving by it saves nothing at this size
    np.linalg.cholesky(np.where(held[:, None] | held, unit, hessian))
    for _ in range(10 * size + 10):
        free = ~active
        slope = gradient + hessian @ s
        direction = np.linalg.solve(np.where(free[:, None] & free, hessian, unit), np.where(free, -slope, 0.0))
        room = np.full(size, np.inf)
        np.divide(np.where(direction < 0.0, lower, upper) - s, direction, out=room, where=direction != 0.0)
        blocking = int(room.argmin())
        if room[blocking] < 1.0:
            bound = lower if direction[blocking] < 0.0 else upper
            s = np.minimum(np.maximum(s + max(room[blocking], 0.0) * direction, lower), upper)
            s[blocking] = bound[blocking]
            active[blocking] = True
            continue
        s = np.minimum(np.maximum(s + direction, lower), upper)
        slope = gradient + hessian @ s
        # multipliers of the active bounds; a negative one wants to leave its bound
        multiplier = np.where(active & ~held, np.where(s <= lower, slope, -slope), np.inf)
        leaving = int(multiplier.argmin())
        if not multiplier[leaving] < -scale:  # nor where it is no number
            break
        active[leaving] = False
    return s
