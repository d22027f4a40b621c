# SPDX-License-Identifier: Apache-2.0
"""HDR-VDP-3's score for older rows: which rows are asked for, in how many runs, and what stays of the file."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.bench.judge import q_jod as module
from mfo_backend.bench.judge.q_jod import scored, without_score
from mfo_backend.bench.report.paper_tables import paper_tables
from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.rows.row_file import RowFile
from mfo_backend.cli.main import main

from ..made_up_rows import row

TRUTH = np.full((4, 4, 3), 0.5, np.float32)


def rows(count, method="balanced", **values):
    return [row(Task("base", i, method), recovered={"roughness": 0.1 * i}, **values) for i in range(count)]


@pytest.fixture
def runs(monkeypatch):
    """A judge that takes 10 minus the mean difference in cd/m^2, and the number of pairs of each of its runs."""
    sizes = []

    def judge(pairs, _pixels_per_degree):
        pairs = list(pairs)
        sizes.append(len(pairs))
        return [10 - float(np.abs(a - b).mean()) for a, b in pairs]

    monkeypatch.setattr(module, "hdr_vdp_q_jods", judge)
    return sizes


def test_only_rows_with_values_and_without_a_score_are_asked_for():
    given = [*rows(3), row(Task("base", 7, "fast")), *rows(1, "best", q_jod=9.0), *rows(2, "paper")]
    chosen = without_score(given, [], ["balanced", "best"])
    assert [r.key for r in chosen] == [("base", i, "balanced") for i in range(3)]
    assert without_score(given, ["noise"], []) == []


def test_many_pairs_go_to_one_run_and_every_row_gets_its_own_score(runs, monkeypatch):
    monkeypatch.setattr(module, "PAIRS_AT_ONCE", 3)
    given = rows(5)
    batches = list(scored(given, lambda r: (TRUTH, TRUTH + np.float32(r.recovered["roughness"])), lambda: False))
    assert runs == [3, 2]
    found = [r.q_jod for batch in batches for r in batch]
    # the median of the truth, 0.5, is shown at 100 cd/m^2
    np.testing.assert_allclose(found, [10 - 20.0 * i for i in range(5)], rtol=1e-4)


def test_a_score_that_is_no_number_stays_missing(monkeypatch):
    monkeypatch.setattr(module, "hdr_vdp_q_jods", lambda pairs, _ppd: [float("nan")] * len(list(pairs)))
    ((found,),) = scored(rows(1), lambda _row: (TRUTH, TRUTH), lambda: False)
    assert found.q_jod is None


def test_a_stop_keeps_whole_batches_only(runs, monkeypatch):
    monkeypatch.setattr(module, "PAIRS_AT_ONCE", 2)
    asked = []
    batches = list(
        scored(rows(6), lambda r: asked.append(r) or (TRUTH, TRUTH), lambda: len(asked) >= 3)  # type: ignore[func-returns-value]
    )
    assert [len(batch) for batch in batches] == [2]


def test_replaced_rows_keep_their_place(tmp_path):
    file = RowFile(tmp_path)
    for each in rows(3):
        file.append(each)
    file.replace(rows(2, q_jod=9.5)[1:])
    assert [r.q_jod for r in file.read()] == [None, 9.5, None]
    assert [r.scene for r in file.read()] == [0, 1, 2]


def test_without_the_judge_the_command_says_so_before_it_renders(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("MFO_HDRVDP3", raising=False)
    assert main(["bench", "judge", str(tmp_path)]) == 3
    assert "MFO_HDRVDP3" in capsys.readouterr().err


def test_the_papers_table_never_mixes_two_metrics():
    def cell(rows):
        ((_, _table), *_) = found = paper_tables(rows)
        table = found[1][1]
        return next(line[2] for line in table.rows if line[0].endswith("`balanced`"))

    both = rows(2, jod=9.0, q_jod=9.9)
    assert cell(both) == "9.90 (9.90/9.90)"
    assert cell([*both, *rows(3, jod=8.0)[2:]]) == "8.67 (8.00/9.00) *"
    assert cell(rows(2)) == "–"
