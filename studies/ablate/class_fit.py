# SPDX-License-Identifier: Apache-2.0
"""Whole jobs in this process, with a rule on or off: from Blender's own material to each class, judged by Cycles."""

from __future__ import annotations

import io
import json
import shutil
import time
from pathlib import Path
from typing import Any

from mfo_backend.bench.rows.summary import SOLVED_FLIP
from mfo_backend.job.output.progress import EventWriter
from mfo_backend.job.run.run_job import run_job
from mfo_backend.job.run.stop import StopSignal
from mfo_backend.types.certainty import Level

from ..child_module import run_module
from ..verdicts.cases import class_case
from ..verdicts.measure import flips_in_cycles, values_of
from ..verdicts.summary import is_wrong

_KIND = "classes"


class ClassFit:
    """Fits case after case of the verdicts' classes; needs a Python with `bpy`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.absolute() / _KIND
        self._judged: dict[str, tuple[float, float]] = {}

    def __call__(self, number: int) -> dict[str, Any]:
        """As `OneFit`; an error is mean FLIP over the target, in Cycles, and solved is one at the noise."""
        case = class_case(number)
        folder = self._folder / case.name
        exported, job = folder / "exported", folder / "job"
        if not exported.is_dir():
            run_module("studies.verdicts.scene", _KIND, number, folder)
            words = ("--object", "Target", "--reference", folder / "reference.exr", "--job", exported)
            run_module("blender_addon.headless", "export", folder / "start.blend", *words)
        shutil.rmtree(job, ignore_errors=True)
        shutil.copytree(exported, job)
        began = time.process_time()
        run_job(job, EventWriter(stream=io.StringIO()), StopSignal())
        seconds = time.process_time() - began
        result = json.loads((job / "result.json").read_text("utf-8"))
        key = json.dumps([case.name, result["recovered"]])
        if key not in self._judged:  # a rule that did nothing needs no picture of its own
            _, _, flip, floor = flips_in_cycles(case, folder)
            self._judged[key] = flip, floor
        flip, floor = self._judged[key]
        values = values_of(case, result)
        sure = {name: value for name, value in values.items() if value.get("level") == Level.DETERMINED.value}
        return {
            "case": case.name,
            "solved": flip - floor <= SOLVED_FLIP,
            "error": flip,
            "wrong": [name for name, value in sure.items() if value["truth"] is not None and is_wrong(value)],
            "seconds": round(seconds, 2),
            "verdict": result.get("verdict"),
        }
