# SPDX-License-Identifier: Apache-2.0
"""A clock that is set or jumps changes nothing: waits and durations come from a clock that cannot be set."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(p for package in ("mfo_backend", "blender_addon") for p in (ROOT / package).rglob("*.py"))
FORBIDDEN = {"time.time", "time.time_ns", "datetime.now", "datetime.utcnow", "datetime.datetime.now", "date.today"}
# dates in names and in a list for the user, and the age of a file that another process may have left
ALLOWED = {"preferences.py", "history.py", "backend_folder.py", "cache_folder.py"}


def test_only_clocks_that_cannot_be_set() -> None:
    used = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Attribute) and ast.unparse(node) in FORBIDDEN and path.name not in ALLOWED:
                used.append(f"{ast.unparse(node)} in {path.name}")
    assert used == []
