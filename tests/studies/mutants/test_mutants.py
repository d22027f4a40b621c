# SPDX-License-Identifier: Apache-2.0
"""The faults that are put in: each compiles, is one change, and its tests are those of its folder."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from studies.mutants.__main__ import ROOT, drawn
from studies.mutants.one_run import files_testing, outcome_of
from studies.mutants.operators import mutants_of
from studies.mutants.page import page

SOURCE = b'''
"""Text - not - computed."""
LIMIT: float = -0.5

def f(x: "int | None" = 3) -> float:
    """Text."""
    if x is None or len(x) < 4:
        raise ValueError(f"{1 + 1}")
    x.sort()
    return min(x) * 2.0
'''


def test_operators_change_one_thing_that_computes() -> None:
    found = {(m.operator, m.old, m.new) for m in mutants_of("a.py", SOURCE)}
    condition = "if x is None or len(x) < 4:"
    assert found == {
        ("sign", "LIMIT: float = -0.5", "LIMIT: float = (0.5)"),
        ("number", "LIMIT: float = -0.5", "LIMIT: float = -5.0"),
        ("logic", condition, "if (x is None and len(x) < 4):"),
        ("comparison", condition, "if (x is not None) or len(x) < 4:"),
        ("comparison", condition, "if x is None or (len(x) >= 4):"),
        ("boundary", condition, "if x is None or (len(x) <= 4):"),
        ("number", condition, "if x is None or len(x) < 5:"),
        ("statement", "x.sort()", "pass"),
        ("arithmetic", "return min(x) * 2.0", "return (min(x) / 2.0)"),
        ("call", "return min(x) * 2.0", "return (max(x)) * 2.0"),
        ("number", "return min(x) * 2.0", "return min(x) * 20.0"),
    }


def test_the_draw_is_large_compiles_and_is_the_same_again() -> None:
    mutants = drawn(ROOT, seed=1)
    assert len(mutants) >= 150
    assert len({mutant.name for mutant in mutants}) == len(mutants)
    assert mutants == drawn(ROOT, seed=1)
    for mutant in mutants:
        source = (ROOT / mutant.path).read_bytes()
        changed = mutant.applied(source)
        ast.parse(changed)
        assert sum(a != b for a, b in zip(source.split(b"\n"), changed.split(b"\n"), strict=True)) == 1
        assert files_testing(ROOT, mutant.path)


@pytest.mark.parametrize(
    ("path", "first"),
    [
        ("mfo_backend/scene/png_file.py", "tests/scene/test_png_file.py"),
        ("blender_addon/result/write_back.py", "tests/addon/result/test_write_back.py"),
        ("blender_addon/export/reference/view_lut.py", "tests/export/reference/test_view_lut.py"),
        ("mfo_backend/fit/alike/simplest.py", "tests/fit/alike/test_simplest.py"),
    ],
)
def test_the_tests_of_the_same_name_come_first(path: str, first: str) -> None:
    tests = files_testing(ROOT, path)
    assert tests[0] == first
    assert all(Path(test).parent == Path(first).parent for test in tests)


def test_a_fault_is_noticed_and_the_copy_is_whole_again(tmp_path: Path) -> None:
    (tmp_path / "mfo_backend/scene").mkdir(parents=True)
    (tmp_path / "tests/scene").mkdir(parents=True)
    source = b"def add(a, b):\n    return a + b\n\n\ndef idle(a):\n    return a * 1.0\n"
    (tmp_path / "mfo_backend/scene/sums.py").write_bytes(source)
    test = (
        "import pytest\nfrom mfo_backend.scene.sums import add\n\n"
        "@pytest.mark.parametrize('a', [1], ids=['an id of words'])\ndef test_sum(a):\n    assert add(a, 2) == 3\n"
    )
    (tmp_path / "tests/scene/test_sums.py").write_text(test)
    outcomes = [outcome_of(m, tmp_path) for m in mutants_of("mfo_backend/scene/sums.py", source)]
    assert [(o.state, o.by) for o in outcomes] == [
        ("killed", "tests/scene/test_sums.py::test_sum[an id of words]"), ("survived", ""), ("survived", ""),
    ]  # fmt: skip
    assert (tmp_path / "mfo_backend/scene/sums.py").read_bytes() == source


def test_the_page_counts_and_names_what_was_not_noticed() -> None:
    row = {"mutant": "a/b.py: x + 1 -> x - 1", "path": "a/b.py", "line": 3, "old": "x + 1", "new": "x - 1",
           "operator": "arithmetic", "commit": "c", "by": "", "seconds": 1.0}  # fmt: skip
    rows = [row | {"state": "survived"}, row | {"mutant": "2", "state": "killed"}, row | {"state": "not counted"}]
    text = page(rows, ["a"])
    assert "| `a` | 2 | 1 | 1 | 50 % |" in text
    assert "`a/b.py`, line 3" in text
    assert "a test is missing" in text
    text = page([*rows, row | {"state": "killed"}], ["a"])  # after a test was written
    assert "| `a` | 2 | 1 | 2 | 100 % |" in text
    assert "a test is missing" not in text
