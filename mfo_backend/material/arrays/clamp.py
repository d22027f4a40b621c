# SPDX-License-Identifier: Apache-2.0
"""Clamps whose derivative is one on the boundary, so that a value fitted to its bound can leave it again."""

from __future__ import annotations

from typing import Any

from . import dual as dr


def saturate(x: Any) -> Any:
    """`x` limited to [0, 1]."""
    return dr.select(x < 0, 0, dr.select(x > 1, 1, x))


def at_least(x: Any, lower: float) -> Any:
    """The larger of `x` and `lower`."""
    return dr.select(x < lower, lower, x)


def root(x: Any) -> Any:
    """Square root with a finite derivative at and below zero."""
    return dr.sqrt(dr.maximum(x, 1e-12))


def mean(colour: Any) -> Any:
    """Mean of the three components."""
    return (colour[0] + colour[1] + colour[2]) * (1 / 3)


def largest(colour: Any) -> Any:
    """Largest of the three components."""
    return dr.maximum(dr.maximum(colour[0], colour[1]), colour[2])
