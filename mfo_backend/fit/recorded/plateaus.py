# SPDX-License-Identifier: Apache-2.0
"""Values inside nodes beyond which nothing changes: a node clips there, and slopes at the value do not know it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...types.certainty import Level
from ...types.parameter import ParameterTable, Vector
from ..result.outcome import listed
from ..tolerances import DETERMINED_BELOW
from .keep_user_values import Judged, Kept
from .refine import OnRecording

# Of a value's range, to both sides of it: three of the deviations below which a value is called determined. Smaller: a
# value close before its plateau is not noticed. Larger: other plateaus than the nearest are. No measurement
BESIDE = 3.0 * DETERMINED_BELOW
ONE_SIDED = "Towards one side the picture hardly changes with {names}: what is further there looks the same."


def with_plateaus(end: OnRecording, kept: Kept) -> Kept:
    """The values with those called weakly determined whose picture hardly changes towards one side.

    Their deviation there is that of the mean slope to a value `BESIDE` them: the same change of the picture, as if it
    were even.
    """
    setting, graph, x = end.recording.setting, end.recording.setting.scene.graph, kept.x
    if graph is None or setting.course.should_stop():
        return kept
    table, first = setting.table, setting.table.length - graph.table.length
    names = [n for n in graph.table.names if n in kept.certainty and kept.certainty[n].level is Level.DETERMINED]
    sides = [
        (name, entry, moved)
        for name in names
        for entry in range(*table.slice_of(name).indices(table.length))
        for moved in (_beside(x, entry, side * BESIDE * table.width[entry], table) for side in (-1.0, 1.0))
        if abs(moved[entry] - x[entry]) > DETERMINED_BELOW * table.width[entry]  # else it is at an end of its range
    ]
    if not sides:
        return kept
    judged, problem = Judged(setting, end.refined), end.refined.all
    image = setting.scene.images_of(end.recording.paths, problem.groups, x)
    here, *beside = graph.plain([x[first:], *(moved[first:] for _, _, moved in sides)])
    shown, rows = judged.residual(image(here))[0], judged.rows(x)[0]
    certainty = dict(kept.certainty)
    for (name, entry, moved), pictures in zip(sides, beside, strict=True):
        change = np.mean(np.square(judged.residual(image(pictures))[0] - shown))
        even = np.mean(np.square(rows[:, :, 1 + entry])) * (moved[entry] - x[entry]) ** 2
        number = entry - table.slice_of(name).start
        sd = list(certainty[name].sd)
        there = kept.certainty[name].sd[number] * float(np.sqrt(even / max(change, 1e-30)))
        if there > DETERMINED_BELOW * table.width[entry]:
            sd[number] = max(sd[number], min(there, float(table.width[entry])))
            certainty[name] = replace(certainty[name], sd=tuple(sd), level=Level.WEAK)
    flat = [table[name].label or name for name in names if certainty[name].level is Level.WEAK]
    notes = (ONE_SIDED.format(names=listed(flat)),) if flat else ()
    return replace(kept, certainty=certainty, notes=(*kept.notes, *notes))


def _beside(x: Vector, entry: int, step: float, table: ParameterTable) -> Vector:
    """The vector with one entry moved, as far as its range goes."""
    moved = x.copy()
    moved[entry] += step
    return table.clip(moved)
