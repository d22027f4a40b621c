# SPDX-License-Identifier: Apache-2.0
"""The table of fits from .blend files counts what was measured, failures included."""

from __future__ import annotations

from mfo_backend.bench.report.blender_section import blender_table
from mfo_backend.bench.rows.blender_row import BlenderRow


def test_counts_and_medians() -> None:
    rows = [
        BlenderRow("wrong", 0, "plastic", "same", 0.03, 0.02, 0.5, 4.0, 5, 1),
        BlenderRow("wrong", 1, "volume", "same", 0.12, 0.02, 0.5, 6.0, 2, 0),
        BlenderRow("wrong", 2, "glass", "different", 0.02, 0.02, 0.3, 8.0),
        BlenderRow("wrong", 3, "cloth", error="Blender ended."),
    ]

    table = blender_table(rows)

    assert table is not None
    assert dict(zip(table.heads, table.rows[0], strict=True)) == {
        "scenario": "wrong", "runs": "4", "failed": "1", "≤ 0.02 above the noise": "2 (50%)", "start FLIP": "0.5",
        "FLIP": "0.03", "noise FLIP": "0.02", "same": "2", "close": "0", "different": "1",
        "same, but > 0.05 above": "1", "different, but at the noise": "1", "determined": "7", "of these wrong": "1",
        "median s": "6",
    }  # fmt: skip


def test_no_rows_make_no_table() -> None:
    assert blender_table([]) is None
