# SPDX-License-Identifier: Apache-2.0
"""A worker that waits, loaded, for its job: it takes one, does it as any other would, and never outlives its parent."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.stability.test_extremes import POINT, ROOT, write_job
from tests.stability.test_same_bits import without_times

WORKER = Path(__file__).parents[1] / "fake_worker.py"
PATIENCE = 60.0  # seconds for what takes one on a quiet machine


def start(*words: str, worker: Path | None = WORKER) -> subprocess.Popen[str]:
    program = [str(worker)] if worker is not None else ["-m", "mfo_backend", "run"]
    return subprocess.Popen(
        [sys.executable, *program, "--progress", "json", "--control", "stdin", *words],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8", cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def give(child: subprocess.Popen[str], job: Path, *more: str) -> None:
    assert child.stdin is not None
    child.stdin.write("".join(line + "\n" for line in ("noise", json.dumps({"cmd": "run", "job": str(job)}), *more)))
    child.stdin.flush()


def test_it_takes_one_job_and_logs_into_its_folder(job: Path) -> None:
    with start("--wait", "60") as child:
        first = json.loads(child.stdout.readline())
        assert first["event"] == "waiting"
        assert first["memory_mb"] is None or first["memory_mb"] > 1
        give(child, job)
        names = [json.loads(line)["event"] for line in child.stdout]
        assert child.wait(PATIENCE) == 0
        assert "prepared" in child.stderr.read()
    assert names[:2] == ["accepted", "started"]
    assert names[-1] == "finished"
    assert "a library prints on stdout" in (job / "backend.log").read_text()
    assert (job / "result.json").is_file()


def test_a_cancel_behind_the_job_is_not_lost(job: Path) -> None:
    (job / "fake.json").write_text(json.dumps({"iterations": 10_000, "seconds": 0.02}))
    with start("--wait", "60") as child:
        give(child, job, '{"cmd": "cancel"}')
        out, _ = child.communicate(timeout=PATIENCE)
    assert json.loads(out.splitlines()[-1])["status"] == "cancelled"
    assert child.returncode == 4


@pytest.mark.parametrize(("seconds", "ends"), [("0.2", False), ("60", True)], ids=["idle", "end of stdin"])
def test_it_ends_where_no_job_comes(seconds: str, ends: bool) -> None:
    with start("--wait", seconds) as child:
        assert json.loads(child.stdout.readline())["event"] == "waiting"
        if ends:
            child.stdin.close()
        assert child.wait(PATIENCE) == 0


def test_it_needs_a_job_or_a_wait() -> None:
    with start(worker=None) as child:
        assert child.wait(PATIENCE) == 2
        assert "one of the arguments job --wait is required" in child.stderr.read()


@pytest.mark.slow
def test_a_job_has_the_same_bits_cold_and_after_a_wait(tmp_path: Path) -> None:
    found = []
    for name in ("cold", "waited"):
        job = write_job(tmp_path / name, light=POINT, power=1.0, preset="fast")
        with start(*([str(job)] if name == "cold" else ["--wait", "60"]), worker=None) as child:
            if name == "waited":
                give(child, job)
            last = [json.loads(line) for line in child.stdout][-1]  # without closing stdin, which would stop it
            assert last["event"] == "finished", last
            assert child.wait(PATIENCE) in (0, 5)  # its reference is no picture of the scene
        result = without_times(json.loads((job / "result.json").read_text()))
        found.append((result, (job / "pictures" / "result.exr").read_bytes()))
    assert found[0] == found[1]


def test_what_every_fit_loads_is_loaded_before_the_job_comes(tmp_path: Path) -> None:
    job = write_job(tmp_path, light=POINT, power=1.0, preset="balanced")
    program = (
        "import sys; from pathlib import Path\n"
        "from mfo_backend.job.output.progress import EventWriter\n"
        "from mfo_backend.job.run.fit_scene import load_everything\n"
        "from mfo_backend.job.run.run_job import run_job\n"
        "from mfo_backend.job.run.stop import StopSignal\n"
        "load_everything(); loaded = set(sys.modules); run_job(Path(sys.argv[1]), EventWriter(), StopSignal())\n"
        "roots = ('mfo_backend', 'mitsuba', 'drjit', 'scipy', 'OpenEXR')\n"
        "print(*sorted(name for name in set(sys.modules) - loaded if name.split('.')[0] in roots))"
    )
    found = subprocess.run([sys.executable, "-c", program, str(job)], capture_output=True, text=True, cwd=ROOT)
    assert (job / "result.json").is_file(), found.stderr
    assert found.stdout.split() == []
