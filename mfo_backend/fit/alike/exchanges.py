# SPDX-License-Identifier: Apache-2.0
"""Materials that are known to be taken for each other, and solves that begin at the other one.

*Other basins.* Under exact lights the race of starts ends as soon as one comes near. With Blender's lobes wrong
materials come within a thousandth: a coat's highlight stands for the base's, a rougher coat for another, a sheen for
none. With Mitsuba's a flat diffuse lobe stands for the metal's share. Further solves start from these. They are given
up where they promise no less.

*Metals.* A black dielectric and a dark metal differ in their reflectance at normal incidence alone.

*Widths.* Cycles clamps the larger of the anisotropic lobe's two widths, roughness^2 / stretch, at 1
(`material/principled/layers.py`). Past that only the other one counts, roughness^2 x stretch. A fit that ends short of
the clamp knows nothing of the flat part: its derivatives call both values determined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...solve.bounded_least_squares import Solution
from ...types.parameter import ParameterTable, Vector
from ..search.global_start import OPPOSITE
from ..squares.problem import Problem, Rival
from ..tolerances import BOX_SD, CLEARLY_LOWER, DETERMINED_BELOW, HOPELESS, MODEL_ERROR, OFF
from .compare import compare
from .simplest import exchangeable, exchanged

# of a start, given up where it promises no less than this cost
SolveBelow = Callable[[Vector, float], Solution]

SOLVED = 1e-8  # a relative error of 1.4e-4 a pixel: no wrong basin of 128 hard cases came as near
MOST_MOVES = 3  # from basin to basin
SHEENS = (0.1, 0.5)  # roughnesses of a sheen to begin with
STRETCH = 0.9  # of Blender's anisotropy: the stretch is the root of 1 less so much of it
PAST = 1.02  # the larger width that says whether the picture knows of the clamp
F0_OF_LEVEL = 0.08  # of a specular level of 1 (Burley 2012; Blender's at an index of 1.5)
DARK_ALBEDO, DARK_F0 = 0.05, 0.1  # black plastic and grey metal look alike below


def best_basin(solve: SolveBelow, found: Solution, table: ParameterTable) -> Solution:
    """`found`, or a solution that costs clearly less."""
    for _ in range(MOST_MOVES):
        if found.equations.cost <= SOLVED:
            break
        limit = CLEARLY_LOWER * found.equations.cost
        solutions = (solve(table.clip(start), limit) for start in moved(found.x, table))
        better = next((other for other in solutions if other.equations.cost < limit), None)
        if better is None:
            break
        found = better
    return found


def moved(x: Vector, table: ParameterTable) -> Iterator[Vector]:
    """Materials that may be taken for `x`, in the order in which they are worth a trial."""
    if {"flatness", "metallic"} <= set(table.names) and table.value(x, "flatness") > OFF:
        yield table.with_values(x, flatness=0.0, metallic=0.5, specular=0.5)
    if not exchangeable(table):
        return
    yield exchanged(x, table)
    yield table.with_values(x, roughness=0.5 * table.value(x, "roughness"))
    yield table.with_values(x, coat_roughness=0.5)
    yield table.with_values(x, coat_weight=0.5)
    if "sheen_weight" in table.names:
        for roughness in SHEENS:
            yield table.with_values(x, sheen_weight=0.5, sheen_roughness=roughness)


def taken_for(x: Vector, table: ParameterTable) -> tuple[Vector, ...]:
    """Materials that may be taken for `x` where light is sampled: those of `moved`, and a metal for a dielectric."""
    others = list(moved(x, table))
    if "metallic" in table.names:
        dielectric, metal = OPPOSITE
        others.insert(0, table.with_values(x, metallic=metal if table.value(x, "metallic") < 0.5 else dielectric))
    return tuple(table.clip(other) for other in others)


def metal_rivals(
    problem: Problem, solve: SolveBelow, found: Solution, table: ParameterTable
) -> tuple[Solution, tuple[Rival, ...]]:
    """The better of `found` and its like among metals or dielectrics, and the other one as a rival of it.

    Nothing but the reflectance at normal incidence tells a black dielectric from a dark metal. Where neither is dark
    there is no rival.
    """
    start = metal_exchanged(found.x, table)
    if start is None:
        return found, ()
    cost = found.equations.cost
    most = _out_of_reach(problem, cost)
    other = solve(table.clip(start), most)
    if other.equations.cost > most or table.apart(other.x, found.x) < DETERMINED_BELOW:
        return found, ()
    if other.equations.cost < cost:
        found, other = other, found
    return found, (Rival(other.x, compare(problem, found.x, other.x, MODEL_ERROR).better),)


def _out_of_reach(problem: Problem, cost: float) -> float:
    """The cost above which a material is no rival of one of this `cost`, on a problem without noise."""
    noise = max(cost, 0.5 * MODEL_ERROR**2)
    return cost + HOPELESS * noise / problem.independent


def metal_exchanged(x: Vector, table: ParameterTable) -> Vector | None:
    """The dark metal that reflects as much as a black dielectric, or the other way round; None where `x` is neither."""
    level = next((name for name in ("specular", "specular_ior_level") if name in table.names), None)
    if level is None or not {"base_color", "metallic"} <= set(table.names):
        return None
    color, metallic = x[table.slice_of("base_color")], table.value(x, "metallic")
    f0 = (1.0 - metallic) * F0_OF_LEVEL * table.value(x, level) + metallic * color
    if np.max((1.0 - metallic) * color) > DARK_ALBEDO or np.max(f0) > DARK_F0:
        return None
    dielectric, metal = OPPOSITE
    if metallic < 0.5:
        return table.with_values(x, metallic=metal, base_color=f0)
    return table.with_values(x, metallic=dielectric, base_color=0.0, **{level: float(f0.mean()) / F0_OF_LEVEL})


def width_rivals(problem: Problem, x: Vector, table: ParameterTable) -> tuple[Rival, ...]:
    """The far end of the materials that look like `x`; none where the lobe is not as wide as can be."""
    if not {"roughness", "anisotropic"} <= set(table.names):
        return ()
    roughness, anisotropic = (table.slice_of(name) for name in ("roughness", "anisotropic"))
    narrow = float(x[roughness][0] ** 2 * _stretch(x[anisotropic][0]))
    least = max(narrow / table["roughness"].upper ** 2, _stretch(table["anisotropic"].upper))

    def alike(stretch: float) -> Vector:
        y = x.copy()
        y[roughness], y[anisotropic] = np.sqrt(narrow / stretch), (1.0 - stretch**2) / STRETCH
        return table.clip(y)

    past = float(np.sqrt(narrow / PAST))
    if past <= least:
        return ()
    cost = problem.equations(x).cost
    if problem.equations(alike(past)).cost > _out_of_reach(problem, cost):
        return ()
    return (Rival(alike(least), BOX_SD**2, last=True),)


def _stretch(anisotropic: float) -> float:
    return float(np.sqrt(1.0 - STRETCH * anisotropic))
