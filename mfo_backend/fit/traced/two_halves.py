# SPDX-License-Identifier: Apache-2.0
"""Least squares on two independent samples of the same rows: what the early stages of a fit of glass know."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...solve.bounded_least_squares import NormalEquations
from ...solve.noisy_least_squares import cross_equations

Rows = NDArray[np.float32]
BRIGHT = 10.0  # weighted residual: about eleven times the reference
CHANNELS = 3  # of a tile follow each other
SURE = 3.0  # standard errors


def two_half_equations(a: Rows, b: Rows) -> NormalEquations:
    """The normal equations of two samples of weighted rows (n, 1 + k), the residual and its derivatives.

    A residual above `BRIGHT` counts as that and has no derivative: the image of a sun in sharp glass flits over the
    tiles with every step, and a single tile then hides what all others say. Under `ph_kiara_1_dawn` the race of six
    random glasses ended, by their geometric mean, at 0.14 of the reference's noise (squares) instead of 0.24 with a
    limit of 3. But what is cut off is missing from the mean: with that limit races under contrasty probes ended too
    dark, and at 30 fireflies rule again (docs/notebook/glass.md).
    """
    first, second = _capped(a), _capped(b)
    product = first.T @ second / len(first)
    return cross_equations(0.5 * (product + product.T))


def is_unsure(a: Rows, b: Rows) -> bool:
    """Whether the mean square of two samples of the rows is less than three of its standard errors over tiles."""
    squares = (a[:, 0].astype(np.float64) * b[:, 0]).reshape(-1, CHANNELS).mean(axis=1)
    return bool(squares.mean() < SURE * squares.std() / np.sqrt(len(squares)))


def _capped(rows: Rows) -> NDArray[np.float64]:
    capped = rows.astype(np.float64)
    bright = capped[:, 0] > BRIGHT
    capped[bright] = 0.0
    capped[bright, 0] = BRIGHT
    return capped
