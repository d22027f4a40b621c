# SPDX-License-Identifier: Apache-2.0
"""The hard-case table of a report, from `hard.jsonl` in the bench's folder (by `studies.recovery.hard_cases`)."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...types.errors import BadInputError
from ..rows.summary import quantile
from .table import Table, number

HARD_ROWS = "hard.jsonl"
_GUARDS = 3  # of the sentences a fit gave, the most frequent
_WORDS = 9  # of each


def hard_section(folder: Path) -> Table | None:
    """Solved, worst error, passes and the guards that spoke, by case; None without rows.

    Raises
    ------
    BadInputError
        If a whole line is no row.
    """
    path = folder / HARD_ROWS
    if not path.is_file():
        return None
    text = path.read_text("utf-8")
    lines = text[: text.rfind("\n") + 1].splitlines()  # not one a killed process left unfinished
    try:
        table = hard_table([json.loads(line) for line in lines if line])
    except (ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"{path} holds a line that is no hard case: remove it ({error!r}).") from None
    return table if table.rows else None


def hard_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The same of rows, which have the keys of `HardRun`."""
    heads = ("case", "runs", "solved", "worst error", "median passes", "not finite", "silent failures",
             "wrongly determined (runs)", "guards that spoke (runs)")  # fmt: skip
    cases = dict.fromkeys(str(row["case"]) for row in rows)
    return Table(heads, [_cells(case, [row for row in rows if row["case"] == case]) for case in cases])


def _cells(case: str, rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    good = sum(bool(row["solved"]) for row in rows)
    spoken = Counter(guard for row in rows for guard in dict.fromkeys(_short(guard) for guard in row["guards"]))
    guards = "; ".join(f"{guard} ({count})" for guard, count in spoken.most_common(_GUARDS))
    return (
        case,
        str(len(rows)),
        f"{good} ({good / len(rows):.0%})",
        number(max(float(row["error"]) for row in rows)),
        number(quantile([float(row["passes"]) for row in rows], 0.5)),
        str(sum(not row["finite"] for row in rows)),
        _wrong(rows, failed=True),
        _wrong(rows, failed=False),
        guards or "–",
    )


def _wrong(rows: Sequence[Mapping[str, Any]], *, failed: bool) -> str:
    """Runs, or failures alone, that call wrong values determined; unknown of rows without that key, which are older."""
    if not all("wrong" in row for row in rows):
        return "–"
    return str(sum(bool(row["wrong"]) and not (failed and row["solved"]) for row in rows))


def _short(guard: str) -> str:
    """What a sentence begins with, without its numbers, so that equal ones count together."""
    words = guard.split(":")[0].split(".")[0].split()
    return " ".join(word for word in words[:_WORDS] if not any(letter.isdigit() for letter in word))
