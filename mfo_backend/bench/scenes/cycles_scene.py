# SPDX-License-Identifier: Apache-2.0
"""Bench scenes that Cycles renders: the scene of `mfo demo` with other materials and worlds, exported as users do.

Blender runs in a process of its own. Truth and reference are Cycles' pictures; the judge's are ours, so its errors hold
what export and renderer lose, which the row tells as `gap_flip`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from ...job.folder.atomic_file import write_atomically
from ...job.folder.job_folder import JobFolder
from ...job.folder.request import read_request
from ...job.run.job_scene import request_materials
from ...material.principled.principled_parameters import PARAMETER_OF_SOCKET
from ...types.parameter import Value
from .scenario import Scenario
from .scene import BenchScene

TRUE_SAMPLES = 512
_REFERENCE_SEED, _TRUTH_SEED = 0, 1  # Cycles' noise of the two is not the same
_FIRST = 1000  # far from the seeds of the documented demos
_DONE = "cycles.json"


class CallsBlender(Protocol):
    """Runs one command of the add-on's `headless.py`."""

    def call(self, *arguments: str | Path) -> Mapping[str, Any]:
        """The JSON object it answers."""
        ...


def write_cycles_scene(scenario: Scenario, number: int, size: int, host: CallsBlender, folder: Path) -> BenchScene:
    """Build, render and export scene `number`; what an earlier bench made of it is taken as it is.

    Raises
    ------
    MfoError
        With Blender's sentence if it fails.
    """
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    reference, truth, job = folder / "reference.exr", folder / "truth.exr", folder / "job"
    if not (folder / _DONE).is_file():
        seed = ("--scene-seed", str(_FIRST + number))
        made = dict(host.call("demo-scene", folder, *seed, "--size", str(size)))
        for out, samples, noise in (
            (reference, scenario.reference_spp, _REFERENCE_SEED),
            (truth, TRUE_SAMPLES, _TRUTH_SEED),
        ):
            words = ("--out", out, "--samples", str(samples), "--seed", str(noise))
            host.call("render", folder / "truth.blend", *words)
        start = folder / "start.blend"
        host.call("export", start, "--object", made["object"], "--reference", reference, "--job", job)
        write_atomically(folder / _DONE, json.dumps(made).encode("utf-8"))
    made = json.loads((folder / _DONE).read_text("utf-8"))
    opened = JobFolder.open(job)
    request = read_request(opened)
    return BenchScene(
        scenario,
        number,
        made["object"],
        "world",
        "",
        job / request.scene,
        (),
        (),
        _values(made["truth"]),
        _values(made["start"]),
        sockets=request_materials(opened, request),
        light_paths=request.light_paths,
        given=(reference, truth),
    )


def _values(sockets: Mapping[str, Any]) -> dict[str, Value]:
    values: dict[str, Value] = {}
    for name, value in sockets.items():
        if name in PARAMETER_OF_SOCKET:
            values[PARAMETER_OF_SOCKET[name]] = tuple(value[:3]) if isinstance(value, list) else float(value)
    return values
