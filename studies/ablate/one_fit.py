# SPDX-License-Identifier: Apache-2.0
"""Fits with a rule on or off, and what became of them."""

from __future__ import annotations

import time
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.bench.judge.judge import Judge
from mfo_backend.bench.judge.promise import is_wrongly_determined, miss
from mfo_backend.bench.rows.row import Row, Task
from mfo_backend.bench.rows.summary import SOLVED_FLIP
from mfo_backend.bench.runs.fit_runner import FitRunner
from mfo_backend.bench.runs.hard_runs import run_hard_case
from mfo_backend.bench.runs.run_bench import measured_row
from mfo_backend.bench.scenes.assets import Assets
from mfo_backend.bench.scenes.hard_cases import HARD_CASES
from mfo_backend.bench.scenes.scenario import SCENARIOS
from mfo_backend.bench.scenes.scene import TABLES
from mfo_backend.cli.blender_host import BlenderHost, find_blender_host
from mfo_backend.types.certainty import Level
from mfo_backend.types.errors import SetupError

from .class_fit import ClassFit

METHOD = "balanced"


class OneFit:
    """Measures a scene of the bench or, for the scenario ``"hard"``, a hard case with its number as the seed; for
    ``"classes"`` a job from Blender's own material to a plastic, metal, coat, cloth, glass, cutout or glowing one."""

    def __init__(self, folder: Path, size: int) -> None:
        self._folder, self._size = folder, size
        self._classes = ClassFit(folder)
        self._runner = FitRunner(folder, size, Assets(None), host=_blender())
        for name in ("picture", "difference_of", "reference_flip", "relit", "flip"):
            _remembered(name)

    def __call__(self, scenario: str, scene: int) -> dict[str, Any]:
        """`solved`, `error` (mean FLIP), names `wrong`ly called determined, `values`, CPU `seconds` of the fit."""
        if scenario == "classes":
            return self._classes(scene)
        if scenario == "hard":
            names = sorted(name for name, case in HARD_CASES.items() if not case.is_glass and case.fitted)
            name, seed = names[scene % len(names)], scene // len(names)
            began = time.process_time()
            run = run_hard_case(HARD_CASES[name], seed, self._size, self._folder / f"hard-{name}-{seed}", METHOD)
            seconds = time.process_time() - began
            return {
                "case": name,
                "solved": run.solved,
                "error": run.error,
                "wrong": list(run.wrong),
                "said": len(run.guards),
                "seconds": round(seconds, 2),
            }
        task = Task(scenario, scene, METHOD)
        row = measured_row(task, lambda: self._runner(task, lambda: False), self._size)
        return {
            "solved": row.flip is not None and row.flip <= SOLVED_FLIP,
            "error": row.flip,
            "wrong": _wrong(row),
            "seconds": None if row.processor_seconds is None else round(row.processor_seconds, 2),
            "raised": row.error,
        }


def _blender() -> BlenderHost | None:
    """A Blender for scenes of Cycles, or None where there is none."""
    try:
        return find_blender_host()
    except SetupError:
        return None


def _wrong(row: Row) -> list[str]:
    """Names that the fit calls determined and that are not the truth's; a measured material has no true values."""
    table = TABLES[SCENARIOS[row.scenario].model]
    return [
        name
        for name, said in row.certainty.items()
        if name in row.truth
        and said["level"] == Level.DETERMINED.value
        and is_wrongly_determined(miss(row.recovered[name], row.truth[name], table[name]), said["sd"], table[name])
    ]


def _remembered(name: str) -> None:
    """Have the judge keep what it found for values: rules that did nothing are judged for nothing."""
    original = getattr(Judge, name)

    @wraps(original)
    def kept(self: Judge, *given: Any) -> Any:
        found = vars(self).setdefault("_remembered", {})
        # pictures follow from the values, and arrays are told apart by what is in them
        key = (name, *(g.tobytes() if isinstance(g, np.ndarray) else repr(g) for g in given))
        if key not in found:
            found[key] = original(self, *given)
        return found[key]

    setattr(Judge, name, kept)
