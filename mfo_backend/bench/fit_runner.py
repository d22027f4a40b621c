# SPDX-License-Identifier: Apache-2.0
"""Measures rows with real fits."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from ..fit.fit_material import FitOutcome
from ..fit.settings import FitSettings
from ..types.status import Status
from .assets import Assets
from .judge import Judge
from .method import method_settings, warm_up_settings
from .row import Row, Task
from .scenario import SCENARIOS
from .scene import SHAPE, BenchScene, write_scene


class FitRunner:
    """Writes scenes into `folder`, fits and judges. All methods of a scene start from the same material and seed.

    Raises
    ------
    SetupError
        If Mitsuba or LLVM is missing.
    """

    def __init__(self, folder: Path, size: int, assets: Assets) -> None:
        from ..render.llvm import configure_llvm, needs_llvm

        if needs_llvm():
            configure_llvm()  # before the first import of drjit
        from ..render.variant import load_variant

        self.size = size
        self.variant = load_variant()
        self._folder = folder
        self._assets = assets
        self._warm: set[tuple[str, str]] = set()
        self._at: tuple[str, int] | None = None
        self._scene: BenchScene
        self._judge: Judge

    def seed(self, task: Task) -> int:
        """The number of the scene; references and the judge have seeds far from it."""
        return task.scene

    def __call__(self, task: Task, should_stop: Callable[[], bool]) -> Row:
        """Fit, then judge; a cancelled fit is not judged."""
        self._open(task)
        settings = method_settings(task.method, self._scene.scenario, self.seed(task))
        warm_up = 0.0
        if (task.scenario, task.method) not in self._warm:
            began = time.monotonic()
            outcome = self._fit(warm_up_settings(settings), should_stop)
            if outcome.result.status is Status.CANCELLED:
                return self._row(task, outcome, 0.0)
            self._warm.add((task.scenario, task.method))
            warm_up = time.monotonic() - began
        return self._row(task, self._fit(settings, should_stop), warm_up)

    def _open(self, task: Task) -> None:
        at = (task.scenario, task.scene)
        if self._at != at:
            self._at = None
            folder = self._folder / f"{task.scenario}-{task.scene:03d}"
            self._scene = write_scene(SCENARIOS[task.scenario], task.scene, self.size, self._assets, folder)
            self._judge = Judge(self._scene)
            self._at = at

    def _fit(self, settings: FitSettings, should_stop: Callable[[], bool]) -> FitOutcome:
        from ..fit.fit_material import fit_material
        from ..fit.fit_recorded import fit_recorded
        from ..render.mitsuba_renderer import load_mitsuba_renderer

        # a renderer of its own for every fit: passes count from 0 and nothing is left over from the fit before
        renderer = load_mitsuba_renderer(
            self._scene.file, SHAPE, model=settings.model, parameters=settings.parameters, materials={}
        )
        # not `recover_material`: a preset that hands a scene over to another has not fitted it
        fit = fit_material if settings.preset == "paper" else fit_recorded
        return fit(renderer, self._judge.reference, settings, listener=lambda event: None, should_stop=should_stop)

    def _row(self, task: Task, outcome: FitOutcome, warm_up: float) -> Row:
        result = outcome.result
        common = {
            "scenario": task.scenario,
            "scene": task.scene,
            "method": task.method,
            "seed": self.seed(task),
            "size": self.size,
            "status": result.status.value,
            "object": self._scene.object,
            "light": self._scene.light,
        }
        if result.status is Status.CANCELLED:
            return Row(**common)
        judge = self._judge
        difference = judge.difference(result.recovered)
        return Row(
            **common,
            seconds=result.seconds,
            warm_up_seconds=warm_up,
            passes=result.passes,
            flip=difference.flip,
            hdr_flip=difference.hdr_flip,
            relative_rmse=difference.relative_rmse,
            relit_relative_rmse=judge.relit_relative_rmse(result.recovered),
            start_flip=judge.start.flip,
            floor_flip=judge.floor.flip,
            floor_relative_rmse=judge.floor.relative_rmse,
            parameter_errors=judge.parameter_errors(result.recovered),
            truth=judge.true_values(),
            recovered=dict(result.recovered),
        )
