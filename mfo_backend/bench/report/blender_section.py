# SPDX-License-Identifier: Apache-2.0
"""The table of fits from .blend files, judged by Cycles."""

from __future__ import annotations

from collections.abc import Sequence

from ...types.verdict import Verdict
from ..rows.blender_row import WRONG, BlenderRow
from ..rows.summary import SOLVED_FLIP, quantile
from .table import Table, number

_HEADS = (
    "scenario", "runs", "failed", f"≤ {SOLVED_FLIP:g} above the noise", "start FLIP", "FLIP", "noise FLIP",
    "same", "close", "different", f"same, but > {WRONG:g} above", "different, but at the noise",
    "determined", "of these wrong", "median s",
)  # fmt: skip


def blender_table(rows: Sequence[BlenderRow]) -> Table | None:
    """Counts and medians of each scenario; None without rows."""
    if not rows:
        return None
    names = dict.fromkeys(row.scenario for row in rows)
    return Table(_HEADS, [_cells(name, [row for row in rows if row.scenario == name]) for name in names])


def _cells(name: str, rows: Sequence[BlenderRow]) -> tuple[str, ...]:
    good = sum(row.excess <= SOLVED_FLIP for row in rows)
    counts = [sum(row.verdict == verdict.value for row in rows) for verdict in Verdict]
    silent = sum(row.verdict == Verdict.SAME.value and row.excess > WRONG for row in rows)
    false = sum(row.verdict == Verdict.DIFFERENT.value and row.excess <= SOLVED_FLIP for row in rows)

    def median(values: Sequence[float | None]) -> str:
        return number(quantile([value for value in values if value is not None], 0.5))

    return (
        name,
        str(len(rows)),
        str(sum(bool(row.error) for row in rows)),
        f"{good} ({good / len(rows):.0%})",
        median([row.start for row in rows]),
        median([row.flip for row in rows]),
        median([row.floor for row in rows]),
        *map(str, counts),
        str(silent),
        str(false),
        str(sum(row.determined for row in rows)),
        str(sum(row.wrong for row in rows)),
        median([row.seconds for row in rows]),
    )
