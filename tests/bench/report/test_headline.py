# SPDX-License-Identifier: Apache-2.0
"""The short table, and that the committed pages hold the one of the committed rows."""

from __future__ import annotations

from pathlib import Path

import pytest

from mfo_backend.bench.report.headline import KINDS, fill, has_block, headline, short
from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.rows.row_file import RowFile
from mfo_backend.bench.scenes.scenario import SCENARIOS
from mfo_backend.cli.main import main

from ..made_up_rows import row

ROOT = Path(__file__).parents[3]
ROWS = [
    *(row(Task("base", scene, "balanced"), flip=0.01, processor_seconds=2.0) for scene in range(3)),
    row(Task("base", 0, "mfo-hdr"), flip=0.01, processor_seconds=80.0),
    row(Task("base", 2, "mfo-hdr"), flip=0.5, processor_seconds=20.0),
    row(Task("noise", 0, "balanced"), flip=0.03, processor_seconds=4.0),
    row(Task("noise", 0, "mfo-hdr"), flip=None, error="no", seconds=None),
]


def test_the_loop_is_compared_on_common_scenes() -> None:
    table = headline(ROWS)
    assert list(table.heads)[4] == "`balanced`: CPU s"
    assert list(table.rows) == [
        ["`base`", "3 of 3", "3", "0.01", "2", "1 of 2", "2", "0.255", "50", "25"],  # 80 / 2 and 20 / 2
        ["`noise`", "0 of 1", "1", "0.03", "4", "0 of 1", "1", "–", "–", "–"],
    ]


def test_the_short_table_has_kinds_of_pictures_on_common_scenes() -> None:
    rows = [
        *ROWS,  # scene 1 of base is not the loop's
        row(Task("parameters", 0, "balanced"), flip=0.03, processor_seconds=4.0),
        row(Task("parameters", 0, "mfo-hdr"), flip=0.015, processor_seconds=24.0),
    ]
    assert list(short(rows).rows) == [
        # a scene of the same number in another scenario is another scene: 80 / 2, 20 / 2 and 24 / 4
        ["a lamp, no noise", "2 of 3", "3", "0.01", "2", "2 of 3", "3", "0.015", "24", "10"],
        ["a light probe, 4 samples a pixel", "0 of 1", "1", "0.03", "4", "0 of 1", "1", "–", "–", "–"],
    ]


def test_the_kinds_leave_no_scenario_out() -> None:
    assert sorted(name for names in KINDS.values() for name in names) == sorted(SCENARIOS)


def test_only_the_block_changes() -> None:
    page = fill("before\n<!-- bench -->\nold\n<!-- end -->\nafter", ROWS)
    assert page.startswith("before\n<!-- bench -->\n| scenes |")
    assert page.endswith("<!-- end -->\nafter")
    assert "old" not in page
    assert fill(page, ROWS) == page
    assert fill("no block", ROWS) == "no block"


def test_a_page_may_have_several_blocks() -> None:
    sure = {"roughness": {"sd": [0.01], "level": "determined"}}
    values = {
        "truth": {"roughness": 0.5},
        "recovered": {"roughness": 0.505},
        "certainty": sure,
        "processor_seconds": 2.0,
    }
    rows = [*ROWS, row(Task("noise", 1, "balanced"), **values), row(Task("noise", 1, "best"), **values)]
    page = fill("<!-- bench loop -->\n<!-- end -->\n<!-- bench promises -->\nold\n<!-- end -->\n<!-- bench -->", rows)
    assert "| base | mfo-hdr | 2 of 2 | 0.01 | 2 of 2 | 0.255 | 0 | 25 |" in page
    assert "| noise | balanced | 1 | 1 | 0 | 1 | 100% |" in page
    assert "| noise | best |" not in page
    assert "old" not in page
    assert page.endswith("<!-- bench -->")
    assert has_block(page)
    assert not has_block("<!-- bench -->")


def test_the_command_fills_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for one in ROWS:
        RowFile(tmp_path).append(one)
    page = tmp_path / "page.md"
    page.write_text("<!-- bench -->\n<!-- end -->\n", "utf-8")
    assert main(["bench", "report", str(tmp_path), "--page", str(page)]) == 0
    assert "| `base` | 3 of 3 |" in page.read_text("utf-8")
    page.write_text("nothing here", "utf-8")
    capsys.readouterr()
    assert main(["bench", "report", str(tmp_path), "--page", str(page)]) == 2
    assert "has no block" in capsys.readouterr().err
    assert main(["bench", "report", str(tmp_path), "--page", str(tmp_path / "none.md")]) == 2


@pytest.mark.parametrize(("page", "rows"), [("README.md", "release"), ("docs/bench/README.md", "full")])
def test_pages_hold_the_committed_rows(page: str, rows: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    assert has_block(text)
    assert fill(text, RowFile(ROOT / "docs/bench" / rows).read()) == text
