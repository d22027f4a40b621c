# SPDX-License-Identifier: Apache-2.0
"""Rows and counts of the recovery table."""

from __future__ import annotations

import dataclasses

import pytest

from studies.recovery.cycles_recovery import LEAST_JOD, LIMIT, SCENES, TABLE, Recovery, summary, table_row

GOOD = Recovery(
    before=0.2, after=0.008, floor=0.006, model=0.007, jod=9.95, jod_floor=9.98, gap=0.012, seconds=12.4, notes=()
)
BAD = dataclasses.replace(GOOD, after=0.05, jod=9.5)
UNJUDGED = dataclasses.replace(GOOD, jod=None, jod_floor=None, gap=None)
HEAD = f"scenes have a mean FLIP of at most {LIMIT} after applying"
LEAST = f"have a JOD of at least {LEAST_JOD}"


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (GOOD, "| 4 | point | 0.2000 | 0.0080 | 0.0060 | 0.0070 | 9.95 | 9.98 | 1.2 % | 12 s |"),
        (UNJUDGED, "| 4 | point | 0.2000 | 0.0080 | 0.0060 | 0.0070 | - | - | - | 12 s |"),
    ],
)
def test_row(found: Recovery, expected: str) -> None:
    assert table_row(4, "point", found) == expected


@pytest.mark.parametrize(
    ("found", "tried", "expected"),
    [
        (
            [GOOD, BAD],
            2,
            f"1 of 2 {HEAD}, 0 failed. 1 of 2 {LEAST}, the lowest is 9.50. The largest FLIP is 0.0500.",
        ),
        ([UNJUDGED], 3, f"1 of 3 {HEAD}, 2 failed. The largest FLIP is 0.0080."),
        ([], 1, f"0 of 1 {HEAD}, 1 failed."),
    ],
)
def test_summary_counts_failures(found: list[Recovery], tried: int, expected: str) -> None:
    assert summary(found, tried) == expected


def test_summary_does_not_count_what_was_not_measured() -> None:
    assert summary([GOOD], 3, 2).startswith(f"1 of 3 {HEAD}, 0 failed, 2 are not measured. ")


def test_table_has_every_scene_and_counts_as_its_rows_do() -> None:
    text = TABLE.read_text("utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")][1:]
    assert [(int(row[0]), row[1]) for row in rows] == list(SCENES)
    good = sum(len(row) == 10 and float(row[3]) <= LIMIT for row in rows)
    assert f"{good} of {len(SCENES)} scenes" in text
