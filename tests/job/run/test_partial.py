# SPDX-License-Identifier: Apache-2.0
"""partial.json: what is left of a job whose process gets SIGKILL, and that nothing is left beside a result."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.job.batch import is_done
from mfo_backend.job.folder.make_job import make_job
from mfo_backend.scene.image_file import write_exr
from tests.render.scenes import POINT, write_scene

from ..conftest import ROOT

posix_only = pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
SECONDS = 120.0  # for the imports and the first second of a fit on a busy machine


def wait_for(path: Path, child: subprocess.Popen) -> None:
    end = time.monotonic() + SECONDS
    while not path.exists():
        assert child.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)


@posix_only
def test_a_killed_fit_leaves_its_best_values(tmp_path: Path) -> None:
    """A real fit with the preset `paper`."""
    folder, size = tmp_path / "job", 32
    write_exr(tmp_path / "reference.exr", np.full((size, size, 3), [0.4, 0.2, 0.1], np.float32))
    settings = FitSettings(
        model="mitsuba_principled",
        preset="paper",
        parameters=("base_color", "roughness"),
        max_iterations=100_000,
        patience=100_000,
    )
    make_job(write_scene(tmp_path, POINT, size=size), "target", tmp_path / "reference.exr", settings, folder)
    child = subprocess.Popen(
        [sys.executable, "-m", "mfo_backend", "run", str(folder), "--progress", "none"],
        env={**os.environ, "PYTHONPATH": str(ROOT), "MFO_THREADS": "1"},
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for(folder / "partial.json", child)
    finally:
        child.kill()
        child.wait()
    assert not (folder / "result.json").exists()
    left = json.loads((folder / "partial.json").read_text("utf-8"))
    assert (left["schema_version"], left["partial"], left["status"]) == (1, True, "failed")
    assert "mse-hdr" in left["sentence"]
    assert left["model"] == "mitsuba_principled"
    assert set(left["recovered"]) == set(left["initial"]) == set(left["bounds"]) == {"base_color", "roughness"}
    for name, value in left["recovered"].items():
        lower, upper = left["bounds"][name]
        assert all(math.isfinite(v) and lower <= v <= upper for v in np.atleast_1d(value))
    # a fit that has gone on for a second: the picture is redder than the start
    assert left["recovered"]["base_color"] != left["initial"]["base_color"]
    assert not is_done(folder)


@posix_only
def test_the_next_run_clears_it_and_a_result_takes_its_place(start_worker, job: Path) -> None:
    child = start_worker("--progress", "json", plan={"iterations": 10_000, "seconds": 0.02})
    wait_for(job / "partial.json", child)
    child.kill()
    child.wait()
    child = start_worker("--progress", "json", plan={"iterations": 1, "seconds": 60})
    assert json.loads(child.stdout.readline())["event"] == "started"
    assert not (job / "partial.json").exists()  # the values of another fit
    child.kill()
    child.wait()
    child = start_worker("--progress", "json")
    out, _ = child.communicate(timeout=60)
    assert child.returncode == 0
    assert (job / "result.json").exists()
    assert not (job / "partial.json").exists()
    assert "best_values" not in out  # a file, no line of the protocol
    left = json.loads((job / "result.json").read_text("utf-8"))
    assert left["partial"] is False
    assert "Light 'Sun' <b>: specular factor is ignored." in left["notes"]
