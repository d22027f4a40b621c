# SPDX-License-Identifier: Apache-2.0
"""From display values back to a place in a view's table, as far as they tell it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Values = NDArray[np.float64]

_STEPS = 40
_SOLVED = 1e-10  # squared distance in display values: far below a level of 16 bits
_FARTHEST = 3.0  # nodes a step: the table is smooth over a few nodes only


def coordinates_of(colours: Values, table: NDArray[np.float32], at: Callable[[Array], tuple[Array, Array]]) -> Values:
    """The coordinates in nodes (count, 3) whose values in `table` come closest to `colours`, display values (count, 3).

    Levenberg-Marquardt for every colour on its own, from the place each channel would have on the grey axis; where the
    table is flat the damping keeps it there. `at` gives values and derivatives by coordinates.
    """
    last = len(table) - 1
    place = _on_grey_axis(colours, table)
    damping = np.full(len(colours), 1e-6)  # against squared slopes of about (0.02 a node)^2
    values, jacobian = at(place)
    cost = np.square(values - colours).sum(axis=-1)
    for _ in range(_STEPS):
        todo = np.flatnonzero((cost > _SOLVED) & (damping < 1e3))
        if not todo.size:
            break
        jac = jacobian[todo].astype(np.float64)
        normal = np.einsum("noi,noj->nij", jac, jac) + damping[todo, None, None] * np.eye(3)
        slope = np.einsum("noi,no->ni", jac, values[todo] - colours[todo])
        step = np.linalg.solve(normal, slope[..., None])[..., 0]
        trial = np.clip(place[todo] - np.clip(step, -_FARTHEST, _FARTHEST), 0, last)
        new_values, new_jacobian = at(trial)
        new_cost = np.square(new_values - colours[todo]).sum(axis=-1)
        better = new_cost < cost[todo]
        damping[todo] = np.where(better, np.maximum(damping[todo] / 5, 1e-9), damping[todo] * 8)
        kept = todo[better]
        place[kept], cost[kept] = trial[better], new_cost[better]
        values[kept], jacobian[kept] = new_values[better], new_jacobian[better]
    return place


def _on_grey_axis(colours: Values, table: NDArray[np.float32]) -> Values:
    nodes = np.arange(len(table), dtype=np.float64)
    grey = np.maximum.accumulate(np.einsum("iiic->ic", table).astype(np.float64), axis=0)
    return np.stack([np.interp(colours[:, c], grey[:, c] + 1e-9 * nodes, nodes) for c in range(3)], axis=-1)
