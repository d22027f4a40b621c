# SPDX-License-Identifier: Apache-2.0
"""Rows of fits from .blend files come back as they were written."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from mfo_backend.bench.rows.blender_row import BLENDER_ROWS, BlenderRow, add_blender_row, read_blender_rows
from mfo_backend.types.errors import BadInputError

ROWS = [
    BlenderRow("graphs", 0, "ramp, lamp", "same", 0.03, 0.02, 0.4, 8.0, 5, 1, "abc"),
    BlenderRow("wrong", 1, "metal, probe, volume", error="Blender ended."),
]


def test_rows_come_back_and_an_unfinished_line_is_none(tmp_path: Path) -> None:
    assert read_blender_rows(tmp_path) == []
    for row in ROWS:
        add_blender_row(tmp_path / "new", row)
    path = tmp_path / "new" / BLENDER_ROWS
    path.write_text(path.read_text("utf-8") + '{"scenario": "gra', "utf-8")

    assert read_blender_rows(tmp_path / "new") == ROWS
    assert ROWS[0].excess == pytest.approx(0.01)
    assert ROWS[1].excess == math.inf


def test_a_whole_line_that_is_no_row_is_named(tmp_path: Path) -> None:
    (tmp_path / BLENDER_ROWS).write_text('{"scene": 1}\n', "utf-8")

    with pytest.raises(BadInputError, match=r"blender\.jsonl holds a line that is no row"):
        read_blender_rows(tmp_path)
