# SPDX-License-Identifier: Apache-2.0
"""The same job gives the same bits with any number of Dr.Jit's threads, glass too; only times differ."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import astuple
from pathlib import Path
from typing import Any

import pytest

from mfo_backend.scene.image_file import read_image

from ..fit.traced.glass import TRUTH, fit, load
from .test_extremes import POINT, ROOT, SKY, run

PRESETS, LIGHTS = ("fast", "balanced"), {"point": POINT, "sky": SKY}


def without_times(result: dict[str, Any]) -> dict[str, Any]:
    """The result with the seconds taken out, also those of the points of a curve."""
    stages = [
        {k: v for k, v in stage.items() if k != "seconds"} | {"curve": [[*p[:3], *p[4:]] for p in stage["curve"]]}
        for stage in result["stages"]
    ]
    return {k: v for k, v in result.items() if k != "seconds"} | {"stages": stages}


def results(threads: int, folder: Path) -> dict[str, Any]:
    """Of every job the result and a digest of its picture."""
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.render.machine.variant import load_variant, use_threads

    load_variant()
    use_threads(threads)
    found = {}
    for preset in PRESETS:
        for name, light in LIGHTS.items():
            job = folder / f"{preset}_{name}"
            job.mkdir()
            _, sentence, result = run(job, light=light, power=1.0, preset=preset)
            assert result, sentence
            pixels = read_image(job / "job" / "pictures" / "result.exr").pixels
            found[job.name] = [without_times(result), hashlib.sha256(pixels.tobytes()).hexdigest()]
    (folder / "glass").mkdir()
    glass = load(folder / "glass", size=24)
    result, _ = fit(glass, glass.image(glass.table.pack(TRUTH), seed=5, spp=16))
    certainty = {name: list(known.sd) for name, known in result.certainty.items()}
    curves = [[[*point[:3], point[4]] for point in map(astuple, stage.curve)] for stage in result.stages]
    found["glass"] = [{"errors": result.errors, "values": result.recovered, "sd": certainty, "curves": curves}, ""]
    return found


@pytest.mark.slow
def test_threads_change_no_bit(tmp_path: Path) -> None:
    found = []
    for number, threads in enumerate((1, 4)):
        folder = tmp_path / str(number)
        folder.mkdir()
        words = [sys.executable, "-m", "tests.stability.test_same_bits", str(threads), str(folder)]
        environment = dict(os.environ, PYTHONPATH=str(ROOT))
        done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=250)
        assert done.returncode == 0, done.stderr[-2000:]
        found.append(json.loads(done.stdout.splitlines()[-1]))
    assert list(found[0]) == ["fast_point", "fast_sky", "balanced_point", "balanced_sky", "glass"]
    for name, (result, _) in found[0].items():
        assert "seconds" not in str(result)
        assert result["errors"]["flip"][0] > 0
        assert [other[name] for other in found] == [found[0][name]] * 2


if __name__ == "__main__":
    print(json.dumps(results(int(sys.argv[1]), Path(sys.argv[2]))), flush=True)
    os._exit(0)
