# SPDX-License-Identifier: Apache-2.0
"""docs/reference/reliability.md says what its records say, and the records say what it promises."""

from __future__ import annotations

import json

import pytest

from .endurance import leaves, summary
from .write_page import PAGE, RECORDS, TABLES, memory_plot, page


def test_the_page_is_that_of_its_records() -> None:
    text = PAGE.read_text("utf-8")
    assert page(text) == text, "run python -m tests.faults.write_page"
    for name in TABLES:
        assert f"<!-- table {name} -->" in text


def record(name: str) -> dict:
    path = RECORDS / f"{name}.json"
    if not path.exists():
        pytest.skip(f"{path.name} is not measured yet")
    return json.loads(path.read_text("utf-8"))


def test_no_kill_left_anything_half() -> None:
    kill = record("kill")
    assert kill["blender"]["moments"] + kill["backend"]["moments"] >= 200
    for key in ("half", "unreadable", "orphans"):
        assert kill["blender"][key] == 0
    for key in ("half", "changed_without_apply", "not_reverted", "without_sentence"):
        assert kill["backend"][key] == 0
    assert kill["blender"]["left_after_next_start"] == kill["backend"]["left"] == []


def test_no_input_crashed_a_reader() -> None:
    fuzz = record("fuzz")
    assert sum(target["inputs"] for target in fuzz.values()) >= 1_000_000
    assert sum(target["killed"] for target in fuzz.values()) == 0


def test_every_limit_ends_without_a_partial_result() -> None:
    for row in record("limits"):
        assert row["left"] == []
        assert (row["result"] == "complete") == (row["exit"] == 0)


def test_a_summary_finds_a_leak_and_a_slowdown() -> None:
    rows = [
        {"seconds": 1.0 + 0.01 * i, "megabytes": 100.0 + 2.0 * i, "files": 9, "threads": 3, "status": "converged"}
        for i in range(105)
    ]
    rows[50]["status"] = "failed"
    found = summary(rows)
    assert found["fits"], found["bad"] == (105, 1)
    assert found["megabytes_per_fit"] == pytest.approx(2.0)
    assert found["seconds"] == [1.095, 1.995]
    assert memory_plot(found).startswith("<svg")


def test_leaves_are_all_numbers_in_order() -> None:
    assert leaves({"b": [1, [2.5]], "a": {"x": 3, "y": "text"}}) == [3.0, 1.0, 2.5]
