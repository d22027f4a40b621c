# SPDX-License-Identifier: Apache-2.0
"""Rows and counts of the recovery table."""

from __future__ import annotations

import dataclasses

import pytest

from bench.cycles_recovery import LIMIT, SCENES, TABLE, Recovery, summary, table_row

GOOD = Recovery(before=0.2, after=0.008, floor=0.006, paired=0.004, model=0.007, seconds=12.4, notes=())
BAD = dataclasses.replace(GOOD, after=0.05, paired=0.045)
NOISY = dataclasses.replace(GOOD, after=0.021, floor=0.02)
HEAD = f"scenes have a mean FLIP of at most {LIMIT} after applying"


def test_row() -> None:
    row = table_row(4, "point", GOOD)
    assert row == "| 4 | point | 0.2000 | 0.0080 | 0.0060 | 0.0040 | 0.0070 | 12 s |"


@pytest.mark.parametrize(
    ("found", "tried", "expected"),
    [
        ([GOOD, BAD], 2, f"1 of 2 {HEAD}, 0 failed. With the same noise the largest is 0.0450."),
        ([GOOD], 3, f"1 of 3 {HEAD}, 2 failed. With the same noise the largest is 0.0040."),
        (
            [GOOD, NOISY],
            2,
            f"1 of 2 {HEAD}, 0 failed, in 1 noise alone gives more. With the same noise the largest is 0.0040.",
        ),
        ([], 1, f"0 of 1 {HEAD}, 1 failed."),
    ],
)
def test_summary_counts_failures(found: list[Recovery], tried: int, expected: str) -> None:
    assert summary(found, tried) == expected


def test_table_has_every_scene_and_counts_as_its_rows_do() -> None:
    text = TABLE.read_text("utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")][1:]
    assert [(int(row[0]), row[1]) for row in rows] == list(SCENES)
    good = sum(len(row) == 8 and float(row[3]) <= LIMIT for row in rows)
    assert f"{good} of {len(SCENES)} scenes" in text
