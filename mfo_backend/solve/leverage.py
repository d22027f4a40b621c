# SPDX-License-Identifier: Apache-2.0
"""Residuals that a least-squares solution without them would leave.

A group of rows that rules the solution pulls it towards itself and makes its own residual small. With its leverage h,
(1 - h)^-1 r is what a solution without it would leave (HC3, J. MacKinnon and H. White, "Some Heteroskedasticity-
Consistent Covariance Matrix Estimators with Improved Finite Sample Properties", 1985; for groups R. Bell and
D. McCaffrey, "Bias Reduction in Standard Errors for Linear Regression with Multi-Stage Samples", 2002).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

MOST_LEVERAGE = 0.9  # of a group: a residual counts ten times at most
SEEN = 0.01  # of a group's leverage; below, its residual grows by a hundredth at most


def residuals_left_out(derivatives: Vector, residual: Vector, inverse: Vector) -> Vector:
    """Residuals (g, n, 1) of solutions that each leave out one group.

    `derivatives` are those of the groups' rows (g, n, k), `residual` what the solution on all groups leaves
    (g, n, 1), `inverse` that of the sum of products of all rows' derivatives (k, k).
    """
    solved = derivatives @ inverse
    of_group = np.einsum("gnk,gnk->g", solved, derivatives)
    ruling = np.flatnonzero(of_group > SEEN)
    leverage = solved[ruling] @ derivatives[ruling].transpose(0, 2, 1)
    leverage *= np.minimum(MOST_LEVERAGE / of_group[ruling], 1.0)[:, None, None]
    found = residual.copy()
    found[ruling] = np.linalg.solve(np.eye(residual.shape[1]) - leverage, residual[ruling])
    return found
