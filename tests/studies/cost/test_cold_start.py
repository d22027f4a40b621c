# SPDX-License-Identifier: Apache-2.0
"""What a process compiles, renders and imports on its way to a result: counts, which no load of the machine changes."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.job.folder.make_job import make_job
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.scene.image_file import write_exr
from studies.cost.cold_start import PHASES, ROOT, table
from tests.render.scenes import AREA, FLOOR, POINT, write_scene


def parts(job, cache) -> dict:
    environment = {**os.environ, "DRJIT_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-m", "studies.cost.cold_start", "--inside", str(job)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return json.loads(done.stdout.splitlines()[-1])


# measured: 17 kernels under a lamp, 24 in a room, 802 modules, 148 of them SciPy's filters, which a verdict takes;
# one heavy library that comes along brings hundreds
@pytest.mark.parametrize(("lights", "depth", "kernels"), [(POINT, 2, 17), (FLOOR + AREA, 4, 24)], ids=["lamp", "room"])
def test_a_process_compiles_few_kernels_and_the_next_one_none(tmp_path, lights, depth, kernels):
    scene = write_scene(tmp_path, lights, size=32, depth=depth)
    renderer = load_renderer(scene, "target", model="mitsuba_principled", parameters="all")
    truth = renderer.table.lower + 0.6 * (renderer.table.upper - renderer.table.lower)
    write_exr(tmp_path / "reference.exr", renderer.image(truth, seed=5, spp=64))
    settings = FitSettings(preset="fast", verify_spp=16)
    make_job(scene, "target", tmp_path / "reference.exr", settings, tmp_path / "job")
    (tmp_path / "cache").mkdir()
    cold, warm = (parts(tmp_path / "job", tmp_path / "cache") for _ in range(2))
    assert 0 < cold["kernels_compiled"] <= kernels
    assert warm["kernels_compiled"] == 0
    assert warm["evaluations"] == cold["evaluations"]  # passes count previews too, which come by the clock
    assert cold["modules"] < 850
    assert set(cold["wall"]) == set(PHASES)
    assert cold["cpu"]["compile"] > 0
    assert warm["cpu"]["compile"] == 0


def test_the_table_names_every_phase():
    row = {"wall": 3.0, "cpu": 4.0, "parts": {
        "wall": dict.fromkeys(PHASES, 0.5), "cpu": dict.fromkeys(PHASES, 0.25), "kernels_compiled": 3,
        "kernel_launches": 9, "passes": 12.5, "flip": [0.2, 0.01],
    }}  # fmt: skip
    text = table("lamp", {"llvm probe, once a machine": {"wall": 1.5, "cpu": 1.2}, "cold": row,
                          "warm": row, "kernels": [3], "kilobytes": 40})  # fmt: skip
    assert all(phase in text for phase in PHASES)
    assert "cold: 3.00 s wall, 4.00 s CPU; 3 kernels compiled" in text
