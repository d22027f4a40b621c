# SPDX-License-Identifier: Apache-2.0
"""Real jobs in an address space that is too small; `tests.faults.limits` has more of them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from ..stability.test_extremes import SKY
from .limits import job, run

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="RLIMIT_AS")


@pytest.mark.parametrize(
    ("megabytes", "size", "light"), [(300, 16, ""), (450, 16, ""), (650, 16, ""), (1100, 1400, SKY.format(1.0))]
)
def test_too_little_memory_is_one_sentence(tmp_path: Path, megabytes: int, size: int, light: str) -> None:
    row = run("", job(tmp_path, size, light), limit=megabytes << 20)
    assert row["exit"] == 2
    assert row["status"] == "bad_input"
    assert f"A fit of {size}x{size} pixels needs about" in row["sentence"]
    assert "are left in this process's address space (ulimit -v): lower the resolution" in row["sentence"]
    assert row["result"] == "none"
    assert row["left"] == []


def test_recording_that_does_not_fit_is_one_sentence(tmp_path: Path) -> None:
    # enough for Mitsuba and the pictures, not for the rays of a sky; no process may end by a signal
    row = run("", job(tmp_path, 512, SKY.format(1.0)), limit=1200 << 20)
    assert row["exit"] == 2
    assert "Tracing the light of this picture needs about" in row["sentence"]


def test_enough_memory_is_not_refused(tmp_path: Path) -> None:
    row = run("", job(tmp_path, 16), limit=900 << 20)
    assert (row["exit"], row["result"]) == (0, "complete"), row["sentence"]
