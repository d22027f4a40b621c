# SPDX-License-Identifier: Apache-2.0
"""Lobes that the user's material lacks and the picture does not ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from ...material.principled.blender_selection import AMOUNT_OF
from ...solve.bounded_least_squares import NormalEquations, Solution, step_in_box
from ...types.parameter import ParameterTable, Vector
from ..tolerances import OFF, SIGNIFICANT

Box = tuple[Vector, Vector]


def solve_without_unneeded(
    solve: Callable[[Vector, Box], Solution],
    around: NormalEquations,
    independent: float,
    x: Vector,
    user: Vector,
    table: ParameterTable,
) -> tuple[Solution, tuple[str, ...]]:
    """The end of `solve` from `x` without the lobes that the quadratic `around` it can do without, and their names.

    Where that costs more than the quadratic promises to the whole box and noise explains, the end in the whole box.
    """
    names = unneeded_lobes(around, independent, x, user, table)
    moved = moved_to_user(names, x, user, table)
    if moved:
        lower, upper = box_holding(table, user, names)
        simpler = solve(np.clip(x, lower, upper), (lower, upper))
        free = around.cost + step_in_box(around, x, table.lower, table.upper)[1]
        if simpler.equations.cost <= free + SIGNIFICANT * len(moved) * around.cost / independent:
            return simpler, tuple(names)
    return solve(x, (table.lower, table.upper)), ()


def moved_to_user(names: Iterable[str], x: Vector, user: Vector, table: ParameterTable) -> list[str]:
    """Those of `names` whose values in `x` are not the user's."""
    return [name for name in names if not np.allclose(x[table.slice_of(name)], user[table.slice_of(name)])]


def unneeded_lobes(
    equations: NormalEquations,
    independent: float,
    found: Vector,
    user: Vector,
    table: ParameterTable,
    least: float = 0.0,
) -> list[str]:
    """Names whose user's value is off and whose return to it the picture cannot tell from noise.

    On the quadratic `equations` around `found`: with the lobes' weights the picture is nearly linear in them.
    `independent` is the number of independent residuals, `least` the least root mean square of one that is no noise.
    """
    noise = max(2.0 * equations.cost, least**2, 1e-30)

    def change(names: list[str]) -> float:
        """How much the cost rises with these names at the user's values and all others at their best."""
        return step_in_box(equations, found, *box_holding(table, user, names))[1]

    return dispensable(values_off(table, user), change, SIGNIFICANT * noise / (2.0 * independent))


def values_off(table: ParameterTable, user: Vector) -> list[str]:
    """Names whose values are off in the user's material, and of tints that are white."""
    return [name for name in table.names if is_plain(name, user, table)]


def is_plain(name: str, x: Vector, table: ParameterTable) -> bool:
    """Whether a value in `x` changes nothing: it is off, or a tint that is white.

    A coat or a sheen with a tint that dims the base's highlight looks like the plain material, so a tint is a lobe's
    equal here.
    """
    if not name.endswith("_tint"):
        return is_off(name, x, table)
    part = table.slice_of(name)
    return bool(np.all((table.upper - x)[part] <= OFF * table.width[part]))


def is_off(name: str, x: Vector, table: ParameterTable) -> bool:
    """Whether a value in `x` is so near its lower bound that it counts as none."""
    part = table.slice_of(name)
    return bool(np.all((x - table.lower)[part] <= OFF * table.width[part]))


def with_user_details(x: Vector, user: Vector, table: ParameterTable) -> Vector:
    """`x` with the user's details of the lobes that it does not have: no picture shows those."""
    y = x.copy()
    for detail, amount in AMOUNT_OF.items():
        if detail not in table.names or amount not in table.names:
            continue
        part = table.slice_of(amount)
        if np.all(x[part] == 0.0):
            y[table.slice_of(detail)] = user[table.slice_of(detail)]
    return y


def dispensable(names: Iterable[str], cost: Callable[[list[str]], float], limit: float) -> list[str]:
    """Those of `names` that can be done without, one after another, the cheapest first, for at most `limit` each."""
    left, without = list(names), []
    now = cost(without)
    while left:
        rise, cheapest = min((cost([*without, name]) - now, name) for name in left)
        if rise > limit:
            break
        without.append(cheapest)
        left.remove(cheapest)
        now += rise
    return without


def box_holding(table: ParameterTable, user: Vector, names: Iterable[str]) -> tuple[Vector, Vector]:
    """The bounds of `table` with these names held at the user's values."""
    lower, upper = table.lower, table.upper
    for name in names:
        part = table.slice_of(name)
        lower[part] = upper[part] = user[part]
    return lower, upper
