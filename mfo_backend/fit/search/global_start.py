# SPDX-License-Identifier: Apache-2.0
"""A start for the fit from nothing: scan the lobe widths, solve for the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...solve.bounded_least_squares import NormalEquations, Solution, SolveLimits, solve_bounded
from ...types.parameter import ParameterTable, Vector

# Geometric in the lobe width: neighbours' highlights overlap, so one of them lies in the right basin.
ROUGHNESS_NODES = (0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 0.9)
SECOND_NODES = (0.3, 0.9)
# From the middle of the box a mirror-like metal is taken for a black plastic: the diffuse lobe can vanish by a black
# colour or by full metallic, and the two are different basins. So every roughness is solved as a metal once, too.
METAL = 0.98
METAL_SECOND_NODES = (0.6,)
# What wrong solutions mistake for each other. Where fits from both end at the same cost, nodes seldom lead lower: by
# half a per cent or more in 3 of 61 scenes with noise
OPPOSITE, OPPOSITE_WIDTH = (1.0 - METAL, METAL), 0.3
# A metal as smooth as the dielectric ended beside it on rough half metals, without noise in 2 of 100 scenes; a rougher
# one in none. Under noise it costs a thirtieth more passes and gains nothing.
ROUGHER_WIDTH = 0.6
# Of the residuals, for one node. With 2 and 8 the first 14 scenes of `base` end at the same FLIP, for 0.95 and 1.04 of
# the passes; those of `noise` with 2, for 0.98
NODE_EVALUATIONS = 4
# Of a thin film, whose colours repeat from order to order of the interference: nanometres, geometric, and indices.
# A bauble of 420 nm and 1.5 is found with six seeds of six, with one without (docs/notebook/hard_cases.md)
FILM = {
    "thin_film_thickness": (120.0, 145.0, 175.0, 210.0, 260.0, 315.0, 380.0, 460.0, 560.0, 680.0, 820.0, 1000.0),
    "thin_film_ior": (1.35, 1.6, 2.0),
}
# Of a brushed surface, whose highlights are stretched along a direction: turns. From no stretch at all one of four was
# not found (docs/notebook/hard_cases.md)
BRUSHED = {"anisotropic": (0.7,), "anisotropic_rotation": (0.0625, 0.1875, 0.3125, 0.4375)}
FURTHER_LOBES = (FILM, BRUSHED)
LOBE_BEGINS = 2  # starts that give the other values: with one the bauble is missed with one seed of six
LOBE_STARTS = 4  # the best different nodes. No measurement of fewer
NODES_APART = 0.2  # of the logarithm of a value: nodes nearer to each other are one start. No measurement
WALLS = 0.1  # of the range: no random start is nearer to an end of it. No measurement


@dataclass(frozen=True)
class ScanNode:
    """One node of the scan: the values it held, whether it was held a metal, the best vector and its cost."""

    held: tuple[float, ...]
    metal: bool
    x: Vector
    cost: float


def scan(
    residuals: Callable[[Vector], NormalEquations],
    table: ParameterTable,
    scanned: Sequence[str],
    should_stop: Callable[[], bool] = lambda: False,
) -> list[ScanNode]:
    """All nodes of the scanned values, best first; those that there were when it was asked to stop.

    With the lobe widths held the image is nearly multilinear in the rest, so a few bounded Gauss-Newton steps from the
    middle of the box solve it; no user start is needed.
    """
    held = [name for name in scanned if name in table.names]
    nodes = []
    for metal, second in ((False, SECOND_NODES), (True, METAL_SECOND_NODES)):
        if metal and "metallic" not in table.names:
            continue
        hold = {"metallic": METAL} if metal else {}
        for values in product(*(ROUGHNESS_NODES if name == scanned[0] else second for name in held)):
            if should_stop():
                break
            holding = {**hold, **dict(zip(held, values, strict=True))}
            nodes.append(ScanNode(values, metal, *_solved(residuals, table, table.begin, holding)))
    return sorted(nodes, key=lambda node: node.cost)


def scan_lobe(
    residuals: Callable[[Vector], NormalEquations],
    table: ParameterTable,
    lobe: Mapping[str, Sequence[float]],
    begins: Sequence[Vector],
    should_stop: Callable[[], bool] = lambda: False,
) -> list[ScanNode]:
    """All nodes of a lobe's values beside the other values of each begin, best first; fewer when asked to stop.

    None where the table does not have its first value, the amount of it.
    """
    held = [name for name in lobe if name in table.names]
    if held[:1] != [next(iter(lobe))]:
        return []
    nodes = []
    for begin in begins:
        for values in product(*(lobe[name] for name in held)):
            if should_stop():
                break
            holding = dict(zip(held, values, strict=True))
            nodes.append(ScanNode(values, False, *_solved(residuals, table, begin, holding)))
    return sorted(nodes, key=lambda node: node.cost)


def _solved(
    residuals: Callable[[Vector], NormalEquations], table: ParameterTable, begin: Vector, holding: Mapping[str, float]
) -> tuple[Vector, float]:
    """A vector with some values held, a few steps from `begin`, and its cost, infinite where that is no number."""
    start, lower, upper = begin.copy(), table.lower, table.upper
    for name, value in holding.items():
        part = table.slice_of(name)
        start[part] = lower[part] = upper[part] = np.clip(value, lower[part], upper[part])
    limits = SolveLimits(evaluations=NODE_EVALUATIONS, cost_change=1e-3, damping=1e-3)
    try:
        solution = solve_bounded(residuals, start, lower, upper, limits)
    except ValueError:
        return start, np.inf
    return solution.x, solution.equations.cost


def agreeing_ends(
    solve: Callable[[Vector], Solution],
    table: ParameterTable,
    scanned: Sequence[str],
    same_cost: float,
    *,
    metal_width: float = OPPOSITE_WIDTH,
    most: float = np.inf,
) -> list[Vector]:
    """Where fits from a dielectric and from a metal in the middle of the box end, the better one first.

    Empty where the costs differ by more than the factor `same_cost` or are above `most`, or where the material's
    metallic is given. `metal_width` is the metal's roughness.
    """
    ends: list[Solution] = []
    widths = (OPPOSITE_WIDTH, metal_width)
    for metallic, width in zip(OPPOSITE, widths, strict=True) if "metallic" in table.names else ():
        start = table.begin
        for name, value in {"metallic": metallic, scanned[0]: width}.items():
            if name in table.names:
                start[table.slice_of(name)] = value
        ends.append(solve(np.clip(start, table.lower, table.upper)))
    ends.sort(key=lambda end: end.equations.cost)
    agree = ends and ends[-1].equations.cost <= min(same_cost * ends[0].equations.cost, most) < np.inf
    return [end.x for end in ends] if agree else []


def random_start(table: ParameterTable, seed: int) -> Vector:
    """A start anywhere in the box but near its walls."""
    return table.lower + table.width * np.random.default_rng(seed).uniform(WALLS, 1.0 - WALLS, table.length)


def best_starts(nodes: Sequence[ScanNode], count: int) -> list[Vector]:
    """The best `count` different nodes, and the best two metals where they are not among these."""
    chosen = different_nodes(nodes, count)
    metals = [node for node in nodes if node.metal][:2]
    return [node.x for node in (*chosen, *(metal for metal in metals if all(metal is not node for node in chosen)))]


def different_nodes(nodes: Sequence[ScanNode], count: int) -> list[ScanNode]:
    """The best `count` nodes that are no neighbours: apart by more than 0.2 in a log value or in being a metal."""
    chosen: list[ScanNode] = []
    for node in nodes:
        if all(_apart(node, other) for other in chosen):
            chosen.append(node)
        if len(chosen) == count:
            break
    return chosen


def _apart(a: ScanNode, b: ScanNode) -> bool:
    return a.metal != b.metal or any(abs(np.log(p / q)) > NODES_APART for p, q in zip(a.held, b.held, strict=True))
