# SPDX-License-Identifier: Apache-2.0
"""A start for the fit from nothing: scan the lobe widths, solve for the rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..solve.bounded_least_squares import NormalEquations, SolveLimits, solve_bounded
from ..types.parameter import ParameterTable

Vector = NDArray[np.float64]

# Geometric in the lobe width: neighbours' highlights overlap, so one of them lies in the right basin.
ROUGHNESS_NODES = (0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 0.9)
SECOND_NODES = (0.3, 0.9)


@dataclass(frozen=True)
class ScanNode:
    """One node of the scan: the scanned values, the best vector found with them held, its cost."""

    held: tuple[float, ...]
    x: Vector
    cost: float


def scan(
    residuals: Callable[[Vector], NormalEquations],
    table: ParameterTable,
    scanned: Sequence[str],
    evaluations: int = 4,
) -> list[ScanNode]:
    """All nodes of the scanned values, best first.

    With the lobe widths held the image is nearly multilinear in the rest, so a few bounded Gauss-Newton steps from the
    middle of the box solve it; no user start is needed.
    """
    held = [name for name in scanned if name in table.names]
    grids = [ROUGHNESS_NODES if name == held[0] == scanned[0] else SECOND_NODES for name in held]
    middle = 0.5 * (table.lower + table.upper)
    nodes = []
    for values in product(*grids):
        start, lower, upper = middle.copy(), table.lower, table.upper
        for name, value in zip(held, values, strict=True):
            start[table.slice_of(name)] = lower[table.slice_of(name)] = upper[table.slice_of(name)] = value
        limits = SolveLimits(evaluations=evaluations, cost_change=1e-3, damping=1e-3)
        solution = solve_bounded(residuals, start, lower, upper, limits)
        nodes.append(ScanNode(values, solution.x, solution.equations.cost))
    return sorted(nodes, key=lambda node: node.cost)


def different_nodes(nodes: Sequence[ScanNode], count: int) -> list[ScanNode]:
    """The best `count` nodes that are no neighbours: apart by more than 0.2 in a log lobe width or in another value."""
    chosen: list[ScanNode] = []
    for node in nodes:
        if all(_apart(node.held, other.held) for other in chosen):
            chosen.append(node)
        if len(chosen) == count:
            break
    return chosen


def _apart(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return any(abs(np.log(p / q)) > 0.2 for p, q in zip(a, b, strict=True)) or not a
