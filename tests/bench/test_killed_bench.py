# SPDX-License-Identifier: Apache-2.0
"""A bench in a process of its own that is killed, interrupted or started twice."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mfo_backend.bench.rows.row_file import RowFile
from mfo_backend.types.errors import BadInputError

ROOT = Path(__file__).resolve().parents[2]
ROWS = 40


def start(folder, seconds):
    words = [sys.executable, "-m", "tests.bench.fake_bench", str(folder), str(seconds)]
    return subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_rows(folder, count):
    path = folder / "rows.jsonl"
    deadline = time.monotonic() + 120
    while not path.exists() or path.read_bytes().count(b"\n") < count:
        assert time.monotonic() < deadline
        time.sleep(0.002)


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL")
def test_killed_again_and_again_no_row_is_lost_or_doubled(tmp_path):
    kept = b""
    for count in (1, 9, 17):
        process = start(tmp_path, 0.01)
        wait_for_rows(tmp_path, count)
        process.kill()
        assert process.wait() == -signal.SIGKILL
        process.communicate()
        now = (tmp_path / "rows.jsonl").read_bytes()
        assert now.startswith(kept)  # what was there stays as it was
        kept = now[: now.rfind(b"\n") + 1]
    process = start(tmp_path, 0.0)
    printed, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    rows = [json.loads(line) for line in (tmp_path / "rows.jsonl").read_text("utf-8").splitlines()]
    keys = [(row["scenario"], row["scene"], row["method"]) for row in rows]
    assert len(keys) == len(set(keys)) == ROWS
    assert "| fast | 20 |" in printed


@pytest.mark.skipif(os.name == "nt", reason="SIGINT to a child")
def test_ctrl_c_ends_with_the_report_of_what_is_there(tmp_path):
    process = start(tmp_path, 0.05)
    wait_for_rows(tmp_path, 3)
    process.send_signal(signal.SIGINT)
    printed, errors = process.communicate(timeout=120)
    assert process.returncode == 4
    rows = len(RowFile(tmp_path).read())
    assert 3 <= rows < ROWS
    assert f"{rows} rows at" in printed
    assert "goes on where it was" in errors
    assert "Traceback" not in errors


def test_two_benches_do_not_share_a_folder(tmp_path):
    first, second = RowFile(tmp_path), RowFile(tmp_path)
    with first.only_writer(), pytest.raises(BadInputError, match="Another bench is writing"), second.only_writer():
        pass
    with second.only_writer():
        pass
