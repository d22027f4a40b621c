# SPDX-License-Identifier: Apache-2.0
"""Counts over the rows of `studies.verdicts`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mfo_backend.bench.rows.blender_row import WRONG

from .measure import Row

VERDICTS = ("same", "close", "different", "failed")
OFF, DEVIATIONS = 0.02, 3.0  # a determined value is wrong beyond both


def summary(rows: Sequence[Row]) -> str:
    """Confusion counts, and how many determined values are wrong."""
    lines = ["| case | " + " | ".join(VERDICTS) + " |", "|---|" + "---|" * len(VERDICTS)]
    groups = {
        "nothing planted": [row for row in rows if not row.case["plant"]],
        "planted": [row for row in rows if row.case["plant"]],
        f"more than {WRONG} above the noise": [row for row in rows if row.excess > WRONG],
        "at the noise (0.02)": [row for row in rows if row.excess <= 0.02],
    }
    for plant in sorted({row.case["plant"] for row in rows} - {""}):
        groups[plant] = [row for row in rows if row.case["plant"] == plant]
    for name, group in groups.items():
        count = Counter(row.verdict for row in group)
        lines.append(f"| {name} | " + " | ".join(str(count[verdict]) for verdict in VERDICTS) + " |")
    wrong, sure = determined(value for row in rows for value in row.values.values())
    lines += ["", f"{wrong} of {sure} values called determined are off by more than {OFF} and 3 deviations."]
    causes = Counter((row.case["plant"], row.cause) for row in rows if row.verdict != "same")
    lines += [f"{plant or 'nothing'}: {cause or 'no cause'} {number}" for (plant, cause), number in causes.items()]
    return "\n".join(lines)


def determined(values: Iterable[dict[str, Any]]) -> tuple[int, int]:
    """How many values called determined are wrong, and how many there are; those of unknown truth are not counted."""
    known = [value for value in values if value.get("level") == "determined" and value["truth"] is not None]
    return sum(is_wrong(value) for value in known), len(known)


def is_wrong(value: dict[str, Any]) -> bool:
    """Whether a fitted value of known truth is further from it than a determined one may be."""
    found, truth = np.ravel(value["value"]), np.ravel(value["truth"])
    away = np.abs(found - truth[: len(found)])
    return bool(np.any((away > OFF) & (away > DEVIATIONS * np.ravel(value["sd"]))))
