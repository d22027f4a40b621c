# SPDX-License-Identifier: Apache-2.0
"""Backends that wait for the next job: taken, gone meanwhile, dying with the job, and one at a time."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from blender_addon.process import job_process, waiting_backend
from blender_addon.process.backend_process import BackendProcess
from blender_addon.process.job_process import JobProcess

from .test_job_process import PRELUDE, drain, gone

pytestmark = pytest.mark.skipif(os.name == "nt", reason="fake workers are POSIX scripts")

WAIT = """
assert sys.argv[4:6] == ["--wait", "60"], sys.argv
say(event="waiting", memory_mb=210)
job = json.loads(sys.stdin.readline())["job"]
say(event="accepted")
"""


def waiting(tmp_path: Path, body: str) -> tuple[BackendProcess, Path]:
    """A fake backend that waits, and the folder of a job for it."""
    script, folder = tmp_path / "waiting_python", tmp_path / "job"
    script.write_text(f"#!{sys.executable}\n{PRELUDE}\n{body}")
    script.chmod(0o755)
    folder.mkdir()
    return BackendProcess(script, wait=60.0, root=tmp_path), folder


def test_one_that_waits_takes_the_job(tmp_path: Path) -> None:
    backend, folder = waiting(tmp_path, WAIT + "say(event='finished', status='stale', sentence=job)")
    while not backend.memory_mb:
        time.sleep(0.01)
    assert backend.memory_mb == 210
    process = JobProcess(backend.python, folder, root=tmp_path, waiting=backend)
    assert [event["event"] for event in drain(process)] == ["finished"]
    assert process.outcome == job_process.Outcome("stale", str(folder))


@pytest.mark.parametrize("end", ["sys.exit(0)", "os.kill(os.getpid(), signal.SIGKILL)"], ids=["idle", "killed"])
def test_another_is_started_where_the_one_that_waited_has_ended(tmp_path: Path, end: str) -> None:
    body = f"if sys.argv[4] == '--wait': {end}\nsay(event='finished', status='stale', sentence=sys.argv[4])"
    backend, folder = waiting(tmp_path, body)
    process = JobProcess(backend.python, folder, root=tmp_path, waiting=backend)
    drain(process)
    assert process.outcome == job_process.Outcome("stale", str(folder))
    assert process.backend is not backend


def test_one_that_dies_with_the_job_is_no_reason_for_another(tmp_path: Path) -> None:
    backend, folder = waiting(tmp_path, WAIT + "os.abort()")
    process = JobProcess(backend.python, folder, root=tmp_path, waiting=backend)
    drain(process)
    assert process.outcome is not None
    assert "crashed (SIGABRT)" in process.outcome.sentence
    assert process.backend is backend


def test_one_backend_waits_at_a_time(tmp_path: Path) -> None:
    backend, _ = waiting(tmp_path, WAIT)
    backend.close(0.0)
    try:
        waiting_backend.prepare(backend.python, 0.0)
        assert waiting_backend.memory_mb() is None
        waiting_backend.prepare(backend.python, 60.0)
        first = waiting_backend._waiting
        waiting_backend.prepare(backend.python, 60.0)
        assert first is not None
        assert waiting_backend._waiting is first
        assert waiting_backend.take(tmp_path / "another python") is None
        assert gone(first.process.pid)
        waiting_backend.prepare(backend.python, 60.0)
        taken = waiting_backend.take(backend.python)
        assert taken is not None
        assert waiting_backend.take(backend.python) is None
        taken.close(0.0)
    finally:
        waiting_backend.close()
