# SPDX-License-Identifier: Apache-2.0
"""Whole jobs of very large pictures and objects; small ones always, the sizes of the record with MFO_HEAVY."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path

import pytest

from mfo_backend.types.status import Status

from .heavy import PIXELS, SEGMENTS, large_pictures, many_triangles
from .write_page import RECORDS

HEAVY = "MFO_HEAVY" in os.environ
DONE = (0, Status.DIFFERENT.exit_code)  # no material makes pictures of noise, and a result says so
WITHOUT_BPY = importlib.util.find_spec("bpy") is None

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "wait4"), reason="peak memory is that of POSIX"),
    pytest.mark.timeout(7200 if HEAVY else 300),
]


def test_large_pictures_end_with_a_result(tmp_path: Path) -> None:
    for row in large_pictures(tmp_path, PIXELS if HEAVY else 64):
        assert row["exit"] in DONE, row


@pytest.mark.skipif(WITHOUT_BPY, reason="the bpy module is not installed")
def test_many_triangles_are_exported_and_fitted(tmp_path: Path) -> None:
    export, fit = many_triangles(tmp_path, SEGMENTS if HEAVY else 20, 32)
    assert export["exit"] == 0, export
    assert fit["exit"] in DONE, fit


def test_the_record_says_a_result_or_a_sentence() -> None:
    rows = json.loads((RECORDS / "heavy.json").read_text("utf-8"))
    said = " ".join(row["what"] for row in rows)
    assert "4096x4096" in said
    assert "2,000,000 triangles" in said
    for row in rows:
        assert row["exit"] >= 0  # no signal
        assert row["sentence"]
