# SPDX-License-Identifier: Apache-2.0
"""Whole jobs at the ends of what a user can give: every number of the result is finite, or one sentence refuses it."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.job.folder.make_job import make_job
from mfo_backend.job.output.progress import EventWriter
from mfo_backend.job.run.run_job import run_job
from mfo_backend.job.run.stop import StopSignal
from mfo_backend.scene.image_file import write_exr
from mfo_backend.types.status import Status

ROOT = Path(__file__).resolve().parents[2]
TRIANGLE = ((-1, 0, -1), (1, 0, -1), (0, 0, 1))
SCENE = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective"><float name="fov" value="35"/>
<transform name="to_world"><lookat origin="0, -4, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/>
<rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="b"><bsdf type="principled"><rgb name="base_color" value="0.5, 0.5, 0.5"/></bsdf></bsdf>
{shape}{light}</scene>"""
POINT = """<emitter type="point"><point name="position" x="2" y="-3" z="3"/>
<rgb name="intensity" value="{0}, {0}, {0}"/></emitter>"""
SKY = '<emitter type="constant"><rgb name="radiance" value="{0}, {0}, {0}"/></emitter>'

MAY_BE_NULL = {"model_gap", "verdict", "verdict_cause", "difference"}


def mesh(normal: tuple[float, float, float] | None = None, more: tuple[tuple[int, int, int], ...] = ()) -> str:
    """An ASCII PLY of one triangle, with one normal for all corners, and further faces of its corners."""
    names = ["x", "y", "z", *(["nx", "ny", "nz"] if normal else [])]
    faces = ((0, 1, 2), *more)
    rows = [" ".join(map(str, (*corner, *(normal or ())))) for corner in TRIANGLE]
    rows += [" ".join(map(str, (3, *face))) for face in faces]
    head = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {name}" for name in names)]
    return "\n".join(
        [*head, f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", *rows]
    )


def write_job(
    folder: Path,
    *,
    width: int = 16,
    height: int = 16,
    light: str = POINT,
    power: float = 40.0,
    ply: str = "",
    reference: Any = None,
    preset: str = "fast",
) -> Path:
    """The folder of a job with a smooth reference of about the picture's brightness, `job` in `folder`."""
    folder.mkdir(exist_ok=True)
    shape = '<shape type="sphere" id="target"><ref id="b"/></shape>'
    if ply:
        (folder / "t.ply").write_text(ply + "\n")
        shape = '<shape type="ply" id="target"><string name="filename" value="t.ply"/><ref id="b"/></shape>'
    text = SCENE.format(width=width, height=height, shape=shape, light=light.format(power))
    (folder / "scene.xml").write_text(text)
    if reference is None:
        reference = power * np.linspace(0.01, 0.03, height * width * 3)
    write_exr(folder / "r.exr", np.reshape(reference, (height, width, 3)).astype(np.float32))
    settings = FitSettings(preset=preset, verify_spp=4, spp=2, max_iterations=4)
    make_job(folder / "scene.xml", "target", folder / "r.exr", settings, folder / "job")
    return folder / "job"


def run(folder: Path, **options: Any) -> tuple[Status, str, dict[str, Any]]:
    """Run the job of `write_job`: its status, sentence and result."""
    job = write_job(folder, **options)
    events = EventWriter(stream=io.StringIO())
    status = run_job(job, events, StopSignal())
    file = job / "result.json"
    return status, events.last_sentence, json.loads(file.read_text()) if file.exists() else {}


def numbers(value: Any) -> list[Any]:
    """All leaves that are no text."""
    if isinstance(value, dict):
        return [n for item in value.values() for n in numbers(item)]
    if isinstance(value, list):
        return [n for item in value for n in numbers(item)]
    return [] if isinstance(value, str) else [value]


@pytest.mark.parametrize(
    "case",
    [
        {"width": 1, "height": 1},
        {"width": 200, "height": 3},
        {"power": 1e-6},
        {"power": 1e6},
        {"power": 1e6, "light": SKY},
        {"power": 1e-6, "preset": "paper"},
        {"power": 1e6, "preset": "paper"},
        {"reference": np.geomspace(1e-6, 1e6, 768)},
        {"reference": np.geomspace(1e-38, 1e38, 768)},
        {"ply": mesh()},
        {"ply": mesh(more=((0, 0, 0), (1, 1, 2)))},
        {"ply": mesh((0, 1, 0))},
    ],
    ids=["1x1", "200x3", "light 1e-6", "light 1e6", "sky 1e6", "light 1e-6 paper", "light 1e6 paper", "reference 1e6",
         "reference 1e38", "one triangle", "zero area", "flipped normals"],
)  # fmt: skip
def test_every_number_is_finite(tmp_path: Path, case: dict[str, Any]) -> None:
    status, sentence, result = run(tmp_path, **case)
    # no material makes some of these pictures, and a result may say so
    assert status.exit_code == 0 or status is Status.DIFFERENT, sentence
    # NaN and infinity are written as null; what is said of the picture is null where the target fills too few blocks
    found = numbers({key: value for key, value in result.items() if key not in MAY_BE_NULL})
    assert None not in found
    assert None not in numbers([part for part in (result["difference"] or {}).values() if part is not None])
    assert len(found) > 50
    lines = (tmp_path / "job" / "progress.jsonl").read_text().splitlines()
    assert None not in numbers([json.loads(line) for line in lines])


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({"ply": mesh((0, 0, 0))}, "No light reaches the target"),
        ({"light": ""}, "has no light"),
        ({"width": 1, "height": 64}, "No pixel sees the target|does not see the target"),
    ],
)
def test_refused_with_one_sentence(tmp_path: Path, case: dict[str, Any], words: str) -> None:
    status, sentence, _ = run(tmp_path, **case)
    assert status is Status.BAD_INPUT
    assert re.search(words, sentence)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no processor affinity here")
def test_one_processor_alone(tmp_path: Path) -> None:
    # Mitsuba waits for ever for an EXR file when its pool has no worker (3.9.1)
    write_exr(tmp_path / "sky.exr", np.full((8, 16, 3), 0.7, np.float32))
    sky = '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'
    code = (
        "import os, sys\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
        f"sys.path.insert(0, {str(ROOT)!r})\nfrom pathlib import Path\nfrom tests.stability.test_extremes import run\n"
        f"print(*run(Path({str(tmp_path)!r}), light={sky!r})[:2], flush=True)\nos._exit(0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.stdout.startswith(("Status.CONVERGED", "Status.DIFFERENT")), done.stderr[-500:]
