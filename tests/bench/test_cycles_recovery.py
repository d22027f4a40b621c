# SPDX-License-Identifier: Apache-2.0
"""Rows and counts of the recovery table."""

from __future__ import annotations

import dataclasses

import pytest

from bench.cycles_recovery import LIMIT, SCENES, TABLE, Recovery, summary, table_row

GOOD = Recovery(before=0.2, after=0.008, floor=0.006, model=0.007, seconds=12.4, notes=())
BAD = dataclasses.replace(GOOD, after=0.05)


def test_row_has_the_excess_over_the_noise() -> None:
    row = table_row(4, "point", GOOD)
    assert row == "| 4 | point | 0.2000 | 0.0080 | 0.0060 | 0.0020 | 0.0070 | 12 s |"


@pytest.mark.parametrize(
    ("found", "tried", "expected"),
    [
        ([GOOD, BAD], 2, "1 of 2 scenes at a mean FLIP of at most 0.012 after applying, 0 failed; largest excess"),
        ([GOOD], 3, "1 of 3 scenes at a mean FLIP of at most 0.012 after applying, 2 failed; largest excess"),
        ([], 1, "0 of 1 scenes at a mean FLIP of at most 0.012 after applying, 1 failed."),
    ],
)
def test_summary_counts_failures(found: list[Recovery], tried: int, expected: str) -> None:
    assert summary(found, tried).startswith(expected)


def test_table_has_every_scene_and_counts_as_its_rows_do() -> None:
    text = TABLE.read_text("utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")][1:]
    assert [(int(row[0]), row[1]) for row in rows] == list(SCENES)
    good = sum(len(row) == 8 and float(row[3]) <= LIMIT for row in rows)
    assert f"{good} of {len(SCENES)} scenes" in text
