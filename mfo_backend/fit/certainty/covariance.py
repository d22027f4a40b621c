# SPDX-License-Identifier: Apache-2.0
"""Standard deviations of recovered values from the last Jacobian, in float64.

Sandwich estimate clustered by group (P. Huber 1967; H. White 1980): Cov = H^-1 (sum_g q_g q_g^T) H^-1 with
q_g = J_g^T r_g. It needs no model of the noise, unlike s^2 H^-1, which is several times too small where neighbouring
pixels or channels share their noise. Where a few pixels rule a value, as those of a highlight do, they count with the
residual that a solution without them would leave (`solve.leverage`). No value leaves its box, so none is less sure than
one that may lie anywhere in it, and what trades against it gains by that.

What nodes give is sampled, and an error of that is the same wherever a pattern is: no residual shows it. How far the
solution would move with half the samples along a pixel stands for it, as a further error that all values share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...solve.leverage import residuals_left_out
from ...types.certainty import Certainty, Level
from ...types.parameter import ParameterTable, Vector
from ..squares.problem import Rival
from ..squares.recording_noise import without_own_noise
from ..tolerances import BOX_SD, DETERMINED_BELOW, MODEL_ERROR, WEAK_BELOW

INFLATION = 1.2  # where own noise in the derivatives is not known
TOGETHER, MOST_TOGETHER = 0.5, 2  # correlation from which on two values move together; so many are named
# Of the box: keeps directions without any effect finite until the box is asked. Of 40 random problems, half with own
# noise, no deviation changes by more than 0.6 % from here on. Smaller: it counts beside the box. Larger: an inverse of
# what no pixel shows loses its digits.
FAR = 10.0

# Error of what nodes give at the fineness of a fit, of what half of it would move the solution by: 1 where errors fall
# as the width of a subpixel does, as at edges, and 1/3 where they fall as its square. Of 40 determined values in 16
# fits 9 are off by more than three deviations without it and 2 with it, and none becomes weak
# (docs/notebook/graph_values.md). Larger: fine patterns are called weak. Smaller: they are wrong in silence.
HALF_AS_FINE = 0.5


@dataclass(frozen=True)
class Further:
    """Derivatives (g, 3, k) of residuals that are not known yet, and the recording's own noise in them (None: none)."""

    derivatives: Vector
    own: Vector | None = None


def covariance(
    rows: Vector,
    own: Vector | None,
    table: ParameterTable,
    model_error: float = MODEL_ERROR,
    further: Further | None = None,
    coarser: tuple[Vector, Vector | None] | None = None,
) -> Vector:
    """Covariance (k, k) in widths of the box from weighted residuals and their derivatives (g, 3, 1 + k), in the box.

    `own` is the recording's noise in them, half the difference of two samples (None for none): squares of derivatives
    hold it, too, and would make every value look better determined. `model_error` is the least error of a residual;
    the default is for relative ones. With what `further` groups would tell, it is that which is to be expected.
    `coarser` are `rows` and `own` as of half the subpixels of what nodes give: how far these would move the solution
    stands for an error of all values together.
    """
    k = rows.shape[2] - 1
    width = table.width
    known, residual, inflation = rows[:, :, 1:] * width, rows[:, :, 0], INFLATION
    noise = np.copysign(np.maximum(np.abs(residual), model_error), residual)
    told = np.zeros((0, *known.shape[1:])) if further is None else further.derivatives * width
    gram, own_products = _products(known) + _products(told), 0.0
    if own is not None:
        half = own[:, :, 1:] * width
        spread = _products(half)
        if further is not None and further.own is not None:
            spread += _products(further.own * width)
        gram, inflation = without_own_noise(gram, spread), 1.0
        own_products = np.einsum("gck,gc->gk", half, own[:, :, 0], optimize=True)
    ridge = float(np.mean(noise**2)) / FAR**2  # in units of the mean noise
    inverse = np.linalg.inv(gram + ridge * np.eye(k))
    left_out = residuals_left_out(known, noise[:, :, None], inverse)[:, :, 0]
    q = np.einsum("gck,gc->gk", known, left_out, optimize=True) - own_products
    moved = q.T @ q
    if len(told):
        # residuals like the present ones, group by group, of signs by chance: these columns have their mean square
        levels, columns = np.linalg.eigh(noise.T @ noise / len(noise))
        root = np.multiply(columns, np.sqrt(np.maximum(levels, 0.0)), dtype=np.float64)
        drawn = np.broadcast_to(root, (len(told), *root.shape))
        q = np.einsum("gck,gcd->gdk", told, residuals_left_out(told, drawn, inverse), optimize=True)
        moved = moved + _products(q)
    g = len(known) + len(told)
    found = inverse @ (moved + ridge * ridge * FAR**2 * np.eye(k)) @ inverse
    found = inflation**2 * g / max(g - k / 3, 1) * found
    if coarser is not None:
        away = HALF_AS_FINE * inverse @ (width * (_gradient(rows, own) - _gradient(*coarser)))
        found = found + np.outer(away, away)
    return _in_box(found)


def _products(rows: Vector) -> Vector:
    """Sum of the products of rows (g, n, k) by themselves, (k, k)."""
    return np.einsum("gnk,gnl->kl", rows, rows, optimize=True)


def _gradient(rows: Vector, own: Vector | None) -> Vector:
    """Sum of derivatives times residuals, without the recording's own noise, (k,)."""
    found = np.einsum("gck,gc->k", rows[:, :, 1:], rows[:, :, 0], optimize=True)
    return found if own is None else found - np.einsum("gck,gc->k", own[:, :, 1:], own[:, :, 0], optimize=True)


def _in_box(spread: Vector) -> Vector:
    """(C^-1 + 1 / BOX_SD^2)^-1 of a covariance C, without the inverse of what may be next to singular."""
    bounded = BOX_SD**2 * np.linalg.solve(spread + BOX_SD**2 * np.eye(len(spread)), spread)
    return 0.5 * (bounded + bounded.T)


def with_rivals(spread: Vector, x: Vector, rivals: Sequence[Rival], width: Vector) -> Vector:
    """A covariance (k, k) in widths of the box around `x`, with those materials that it might be instead."""
    for rival in rivals:
        away = (rival.x - x) / width
        spread = spread + rival.share * np.outer(away, away)
    return spread


def standard_deviations(spread: Vector, table: ParameterTable) -> Vector:
    """Standard deviation (k,) of each value, in its own unit, from a `covariance`."""
    return table.width * np.sqrt(np.maximum(np.diag(spread), 0.0))


def certainties(sd: Vector, table: ParameterTable, spread: Vector | None = None) -> dict[str, Certainty]:
    """Certainty of each value; a colour is as sure as its worst channel.

    By the covariance `spread` (k, k), where given, a certainty names the values that it can be traded against.
    """
    along = {} if spread is None else _traded(spread, table)
    result = {}
    for parameter in table:
        part = sd[table.slice_of(parameter.name)]
        worst = float(part.max()) / (parameter.upper - parameter.lower)
        if worst < DETERMINED_BELOW:
            level = Level.DETERMINED
        else:
            level = Level.WEAK if worst < WEAK_BELOW else Level.NOT_VISIBLE
        others = along.get(parameter.name, ())
        shown = tuple(table[name].shown for name in others)
        result[parameter.name] = Certainty(tuple(float(v) for v in part), level, others, shown)
    return result


def certainties_away(known: Mapping[str, Certainty], away: Vector, table: ParameterTable) -> dict[str, Certainty]:
    """Certainty of an end that lies `away` (k,) from the one whose certainty is `known`: both explain the picture."""
    if not known:
        return {}
    sd = np.concatenate([known[name].sd for name in table.names])
    found = certainties(np.hypot(sd, away), table)
    return {
        name: replace(certainty, along=known[name].along, shown=known[name].shown) for name, certainty in found.items()
    }


def _traded(spread: Vector, table: ParameterTable) -> dict[str, tuple[str, ...]]:
    """For each value the names of others whose errors go along with its own, the most so first."""
    sd = np.sqrt(np.maximum(np.diag(spread), 1e-30))
    correlation = np.abs(spread / np.outer(sd, sd))
    found = {}
    for name in table.names:
        rows = correlation[table.slice_of(name)]
        shared = {other: float(rows[:, table.slice_of(other)].max()) for other in table.names if other != name}
        together = sorted((n for n, c in shared.items() if c > TOGETHER), key=lambda n: -shared[n])
        found[name] = tuple(together[:MOST_TOGETHER])
    return found
