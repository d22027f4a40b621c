# SPDX-License-Identifier: Apache-2.0
"""`mfo bench` with a runner that needs no renderer, and the report of its folder."""

from __future__ import annotations

import argparse
from functools import partial

import pytest

from mfo_backend.bench.rows.row_file import RowFile
from mfo_backend.bench.runs.run_bench import all_tasks, run_bench
from mfo_backend.cli.commands.bench import work
from mfo_backend.cli.main import main
from tests.bench.made_up_rows import FakeRunner


def arguments(folder) -> argparse.Namespace:
    return argparse.Namespace(scenario=["base"], method=["fast", "mfo-hdr"], scenes=2, out=folder)


def test_rows_and_report(tmp_path, capsys):
    assert work(arguments(tmp_path), partial(run_bench, runner=FakeRunner(), machine={"threads": 2})) == 0
    assert len(RowFile(tmp_path).read()) == 4
    assert "| fast | 2 | 0 | 2 (100%)" in capsys.readouterr().out
    assert main(["bench", "report", str(tmp_path), "--note", "A remark."]) == 0
    assert "A remark." in capsys.readouterr().out


def test_a_stopped_bench_reports_what_is_there_and_exits_with_4(tmp_path, capsys):
    runner = FakeRunner(cancelled=all_tasks(["base"], ["fast", "mfo-hdr"], 2)[3])
    assert work(arguments(tmp_path), partial(run_bench, runner=runner, machine={})) == 4
    captured = capsys.readouterr()
    assert "| fast | 1 |" in captured.out
    assert "goes on where it was" in captured.err


def test_a_folder_without_rows_has_no_report(tmp_path, capsys):
    assert main(["bench", "report", str(tmp_path)]) == 2
    assert "holds no rows" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--scenes", "0"], ["--method", "magic"], ["--scenario", "moon"]])
def test_unknown_names_and_no_scenes_are_refused(words, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["bench", *words])
