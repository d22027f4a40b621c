# SPDX-License-Identifier: Apache-2.0
"""No row is lost or doubled, whatever ends a bench; what raises is a row."""

from __future__ import annotations

import json

import pytest

from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.rows.row_file import RowFile, keep_setup
from mfo_backend.bench.runs.run_bench import all_tasks, run_bench
from mfo_backend.types.errors import BadInputError

from ..made_up_rows import FakeRunner, row

TASKS = all_tasks(["base", "noise"], ["mfo-hdr", "fast"], 2)


def bench(folder, runner, tasks=TASKS, stop=lambda: False):
    shown = []
    done = run_bench(tasks, RowFile(folder), runner, machine={"threads": 2}, listener=shown.append, should_stop=stop)
    return done, shown


def test_quick_methods_come_first_then_scene_by_scene():
    tasks = all_tasks(["base", "noise"], ["mfo-hdr", "fast", "mse-hdr"], 2)
    assert [task.key for task in tasks[:6]] == [
        ("base", 0, "fast"),
        ("noise", 0, "fast"),
        ("base", 1, "fast"),
        ("noise", 1, "fast"),
        ("base", 0, "mfo-hdr"),
        ("base", 0, "mse-hdr"),
    ]
    assert len(set(TASKS)) == 8


@pytest.mark.parametrize("stop_after", range(len(TASKS)))
def test_a_stopped_bench_goes_on_where_it_was(tmp_path, stop_after):
    first, second = FakeRunner(), FakeRunner()
    done, _ = bench(tmp_path, first, stop=lambda: len(first.asked) >= stop_after)
    assert not done
    done, shown = bench(tmp_path, second)
    assert done
    assert first.asked + second.asked == TASKS
    assert len(shown) == len(TASKS) - stop_after
    assert [r.key for r in RowFile(tmp_path).read()] == [task.key for task in TASKS]
    assert all(r.machine == {"threads": 2} for r in RowFile(tmp_path).read())


@pytest.mark.parametrize("cut", [1, 20, 10_000])
def test_a_bench_killed_while_it_writes_does_the_row_again(tmp_path, cut):
    bench(tmp_path, FakeRunner(), TASKS[:3])
    file = RowFile(tmp_path)
    whole = file.path.read_bytes()
    last = whole.splitlines(keepends=True)[-1]
    file.path.write_bytes(whole[: len(whole) - min(cut, len(last) - 1)])  # at least one byte of the row was written
    assert len(file.read()) == 2
    again = FakeRunner()
    bench(tmp_path, again)
    assert again.asked == TASKS[2:]
    lines = file.path.read_text().splitlines()
    assert [json.loads(line)["method"] for line in lines] == [task.method for task in TASKS]


def test_what_raises_is_a_row_with_its_sentence_and_is_not_tried_again(tmp_path):
    broken = {TASKS[1]: BadInputError("Glass is not recorded."), TASKS[2]: ZeroDivisionError("by zero")}
    done, _ = bench(tmp_path, FakeRunner(broken))
    rows = RowFile(tmp_path).read()
    assert done
    assert [(r.status, r.error) for r in rows[:3]] == [
        ("converged", ""),
        ("bad_input", "Glass is not recorded."),
        ("failed", "ZeroDivisionError: by zero"),
    ]
    assert rows[1].flip is None
    again = FakeRunner()
    bench(tmp_path, again)
    assert again.asked == []


def test_a_fit_that_was_cut_short_leaves_no_row(tmp_path):
    done, _ = bench(tmp_path, FakeRunner(cancelled=TASKS[1]))
    assert not done
    assert [r.key for r in RowFile(tmp_path).read()] == [TASKS[0].key]


def test_rows_keep_every_value_and_numbers_that_json_lacks_are_null(tmp_path):
    file = RowFile(tmp_path)
    one = row(Task("base", 3, "fast"), truth={"base_color": [0.1, 0.2, 0.3]}, hdr_flip=float("nan"), error="„")
    file.append(one)
    (read,) = file.read()
    assert read.hdr_flip is None
    assert (read.truth, read.error, read.seconds) == (one.truth, "„", 2.0)


def test_a_damaged_line_is_refused_by_number(tmp_path):
    file = RowFile(tmp_path)
    file.append(row(Task("base", 0, "fast")))
    with open(file.path, "a") as damaged:
        damaged.write("{]\n")
    with pytest.raises(BadInputError, match=r"Line 2 of .* is no row of a bench"):
        file.read()


def test_rows_of_another_size_are_not_mixed_in(tmp_path):
    keep_setup(tmp_path, {"size": 96, "objects": []})
    keep_setup(tmp_path, {"size": 96, "objects": []})
    with pytest.raises(BadInputError, match="made with another size: give another folder"):
        keep_setup(tmp_path, {"size": 64, "objects": []})
