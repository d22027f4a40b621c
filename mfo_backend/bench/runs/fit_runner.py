# SPDX-License-Identifier: Apache-2.0
"""Measures rows with real fits."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ...fit.result.outcome import FitOutcome
from ...fit.settings import FitSettings
from ...job.folder.atomic_file import write_atomically
from ...types.errors import SetupError
from ...types.event import Event, StageEnd
from ...types.image import Pixels
from ...types.status import Status
from ..judge.judge import Judge, TruePictures
from ..rows.method import METHODS, method_settings, warm_up_settings
from ..rows.row import Row, Task
from ..rows.row_pictures import picture_file, shown_picture
from ..scenes.assets import Assets
from ..scenes.cycles_scene import CallsBlender, write_cycles_scene
from ..scenes.scenario import SCENARIOS, Scenario
from ..scenes.scene import SHAPE, BenchScene, write_scene
from .busy import BusyMark
from .stopwatch import Stopwatch
from .wrapped_renderer import NewSeeds


@dataclass(frozen=True)
class _Measured:
    """A fit with what was measured around it."""

    outcome: FitOutcome
    load_seconds: float
    parts: Mapping[str, float] = field(default_factory=dict)
    processor_seconds: float | None = None
    others_busy: float | None = None
    stage_ends: Mapping[str, float] = field(default_factory=dict)  # processor seconds until then


class FitRunner:
    """Writes scenes into `folder`, fits and judges. All methods of a scene start from the same material and seed, the
    number of the scene; references and the judge have seeds far from it. Pictures go to `pictures`, if that is given.
    Unless `warm_up` is false, a fit before the first of its kind keeps the compiling of kernels out of its seconds.

    Raises
    ------
    SetupError
        If Mitsuba or LLVM is missing.
    """

    def __init__(
        self,
        folder: Path,
        size: int,
        assets: Assets,
        pictures: Path | None = None,
        *,
        threads: int = 0,
        host: CallsBlender | None = None,
        warm_up: bool = True,
    ) -> None:
        from ...render.machine.llvm import configure_llvm, needs_llvm

        if needs_llvm():
            configure_llvm()  # before the first import of drjit
        from ...render.machine.variant import load_variant, thread_count, use_threads

        self.size = size
        began = time.monotonic()
        self.variant = load_variant()
        self.import_seconds = time.monotonic() - began
        if threads:
            use_threads(threads)
        self.threads = thread_count()
        self._folder = folder
        self._assets = assets
        self._kept_at = pictures
        self._host = host
        self._warms_up = warm_up
        # scenarios, methods and lights: a light probe of another size needs other kernels
        self._warm: set[tuple[str, str, str]] = set()
        self._at: tuple[str, int] | None = None
        self._scene: BenchScene
        self._judge: Judge

    def __call__(self, task: Task, should_stop: Callable[[], bool], pictures: TruePictures | None = None) -> Row:
        """Fit, then judge; a cancelled fit is not judged. `pictures` are those of the scene, if they are there."""
        self._open(task, pictures)
        settings = method_settings(task.method, self._scene.scenario, task.scene)
        warm_up = 0.0
        kind = (task.scenario, task.method, self._scene.light)
        if self._warms_up and kind not in self._warm:
            began = time.monotonic()
            measured = self._fit(task, warm_up_settings(settings), should_stop)
            if measured.outcome.result.status is Status.CANCELLED:
                return self._row(task, measured, 0.0)
            self._warm.add(kind)
            warm_up = time.monotonic() - began
        return self._row(task, self._fit(task, settings, should_stop), warm_up)

    def pictures(self, task: Task) -> TruePictures:
        """The true pictures of the task's scene."""
        self._open(task, None)
        return self._judge.pictures

    def judged_pair(self, row: Row) -> tuple[Pixels, Pixels]:
        """The pictures that the scores of a row are of: the truth's and the recovered values'."""
        self._open(Task(row.scenario, row.scene, row.method), None)
        return self._judge.pair(row.recovered, row.judge_spp)

    def _open(self, task: Task, pictures: TruePictures | None) -> None:
        at = (task.scenario, task.scene)
        if self._at != at:
            self._at = None
            folder = self._folder / f"{task.scenario}-{task.scene:03d}"
            self._scene = self._write(SCENARIOS[task.scenario], task.scene, folder)
            self._judge = Judge(self._scene, pictures)
            self._at = at
            if self._kept_at is not None:
                self._keep_picture(Task(*at, "reference"), self._judge.pictures.reference)
                self._keep_picture(Task(*at, "truth"), self._judge.pictures.truth[0])

    def _write(self, scenario: Scenario, number: int, folder: Path) -> BenchScene:
        if not scenario.cycles:
            return write_scene(scenario, number, self.size, self._assets, folder)
        if self._host is None:
            raise SetupError("Scenes of Cycles need the bpy module or a Blender program, and one process.")
        return write_cycles_scene(scenario, number, self.size, self._host, folder)

    def _fit(self, task: Task, settings: FitSettings, should_stop: Callable[[], bool]) -> _Measured:
        from ...fit.recover_material import recover_material
        from ...render.pictures.mitsuba_renderer import load_mitsuba_renderer

        reference = self._judge.reference  # rendered before time is taken
        began, method = time.monotonic(), METHODS[task.method]
        # a renderer of its own for every fit: passes count from 0 and nothing is left over from the fit before
        renderer = load_mitsuba_renderer(
            self._scene.file,
            SHAPE,
            model=settings.model,
            parameters=settings.parameters,
            materials=self._scene.materials,
        )
        loaded, watch, busy = time.monotonic() - began, Stopwatch(), BusyMark.now()
        ends: dict[str, float] = {}

        def note_end(event: Event) -> None:
            if isinstance(event, StageEnd):
                ends[event.stage] = busy.own_seconds()

        with watch.watching():
            outcome = recover_material(
                NewSeeds(renderer, settings.seed) if method.new_seeds else renderer,
                reference,
                settings,
                plan=method.plan,
                hand_over=False,  # a preset that hands a scene over to the preset `paper` has not fitted it
                listener=note_end,
                should_stop=should_stop,
            )
        return _Measured(outcome, loaded, watch.parts, busy.own_seconds(), busy.others(), ends)

    def _row(self, task: Task, measured: _Measured, warm_up: float) -> Row:
        result, scene = measured.outcome.result, self._scene
        common = {
            "scenario": task.scenario,
            "scene": task.scene,
            "method": task.method,
            "seed": task.scene,
            "size": self.size,
            "status": result.status.value,
            "object": scene.object,
            "light": scene.light,
            "material": scene.material,
        }
        if result.status is Status.CANCELLED:
            return Row(**common)
        judge = self._judge
        picture = judge.picture(result.recovered)
        self._keep_picture(task, picture)
        difference, judge_spp = judge.settled(judge.difference_of(picture), result.recovered, picture)
        relit = judge.relit(result.recovered)
        start, floor = judge.pictures.start, judge.pictures.floor
        return Row(
            **common,
            seconds=result.seconds,
            load_seconds=measured.load_seconds,
            warm_up_seconds=warm_up,
            parts=dict(measured.parts),
            others_busy=measured.others_busy,
            passes=result.passes,
            processor_seconds=measured.processor_seconds,
            flip=difference.flip,
            hdr_flip=difference.hdr_flip,
            relative_rmse=difference.relative_rmse,
            jod=difference.jod,
            q_jod=difference.q_jod,
            judge_spp=judge_spp,
            relit_relative_rmse=sum(d.relative_rmse for d in relit) / len(relit) if relit else None,
            relit_flips=[d.flip for d in relit],
            reference_flip=judge.reference_flip(picture),
            start_flip=start.flip,
            floor_flip=floor.flip,
            floor_relative_rmse=floor.relative_rmse,
            gap_flip=judge.pictures.gap_flip,
            stages=[
                {
                    "name": stage.name,
                    "status": stage.status.value,
                    "iterations": stage.iterations,
                    "passes": stage.curve[-1].passes if stage.curve else None,
                    "processor_seconds": measured.stage_ends.get(stage.name),
                    "flip": judge.flip(stage.values),
                }
                for stage in result.stages
            ],
            parameter_errors=judge.parameter_errors(result.recovered),
            truth=judge.true_values(),
            recovered=dict(result.recovered),
            certainty={
                name: {"sd": list(certainty.sd), "level": certainty.level.value}
                for name, certainty in result.certainty.items()
            },
            verdict="" if result.judgement is None else result.judgement.verdict.value,
            notes=list(result.notes),
        )

    def _keep_picture(self, task: Task, pixels: Pixels) -> None:
        if self._kept_at is None:
            return
        path = picture_file(self._kept_at, task)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, shown_picture(pixels, self._judge.pictures.truth[0], self._judge.pictures.mask))
