# SPDX-License-Identifier: Apache-2.0
"""Real jobs that run out of something, each ending in one sentence with its cure; `tests.faults.limits` has more."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from mfo_backend.types.status import Status

from ..stability.test_extremes import SKY
from .limits import PERMISSIONS_BIND, close, job, run

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="RLIMIT_AS, permissions")


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
    assert row["exit"] in (0, Status.DIFFERENT.exit_code), row["sentence"]  # a picture that no material makes
    assert row["result"] == "complete"


@pytest.mark.skipif(not PERMISSIONS_BIND, reason="root, and setpriv is not installed")
def test_permission_to_write_that_is_lost_under_way(tmp_path: Path) -> None:
    path = job(tmp_path, 24)
    row = run("", path, on_start=close)
    assert row["exit"] == 2
    assert "cannot be written (Permission denied): free some space, change its permissions" in row["sentence"]
    assert row["result"] == "none"


@pytest.mark.skipif(not PERMISSIONS_BIND, reason="root, and setpriv is not installed")
def test_a_folder_that_may_only_be_read(tmp_path: Path) -> None:
    path = job(tmp_path, 16)
    path.chmod(0o555)
    row = run("", path)
    assert row["exit"] == 2
    assert "cannot be written (Permission denied): free some space, change its permissions" in row["sentence"]


@pytest.mark.parametrize("version", [None, 14, 15])
def test_no_llvm_or_one_that_is_too_old(tmp_path: Path, version: int | None) -> None:
    library = Path(f"/usr/lib/x86_64-linux-gnu/libLLVM-{version}.so")
    if version and not library.exists():
        pytest.skip("not installed")
    row = run("", job(tmp_path, 16), only_llvm=[library] if version else [])
    assert row["exit"] == 3
    assert row["sentence"].startswith("No usable LLVM" if version else "No LLVM library was found: ")
    assert "run `apt install libllvm19`" in row["sentence"]
    assert row["result"] == "none"
