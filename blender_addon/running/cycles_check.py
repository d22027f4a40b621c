# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders by a Blender of their own, beside this one: the result judged in Cycles, and the reference as an EXR.

The one task that runs is looked after by a timer in windows and by `wait` in background mode.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ..check.preflight import redraw
from ..pictures import previews
from ..process.backend_python import EXTENSION_ROOT, backend_environment
from ..process.background_task import TASK_TICK, BackgroundTask, Step, environment_for
from ..process.saved_file import save_copy
from ..process.temporary_folder import make_folder
from ..result import shown_result


@dataclass(frozen=True)
class _Running:
    task: BackgroundTask
    folder: Path  # temporary
    done: Callable[[list[dict[str, Any]]], None]


_current: _Running | None = None


def engine_name(engine: str) -> str:
    """What a user calls a render engine."""
    return engine.removeprefix("BLENDER_").replace("_NEXT", "").replace("_", " ").title()


def is_running() -> bool:
    """Whether a Blender renders for us."""
    return _current is not None


def check_result(job: Path, material: str, python: Path) -> None:
    """Render the scene as it is with the values of a job in Cycles and measure it against the job's reference.

    Where the scene has another engine, such as Eevee, the same is done with that: it is what the user sees every day.

    Raises
    ------
    OSError
        If no copy of the scene can be written or no Blender can be started.
    """

    def done(answers: list[dict[str, Any]]) -> None:
        runtime = _runtime()
        flips = [float(answer["metrics"]["flip"]) for answer in answers[1::2]]
        said = f"FLIP in Cycles: {flips[0]:.4f}"
        runtime.cycles_text = f"{said}. In {engine}: {flips[1]:.4f}." if len(flips) > 1 else said
        runtime.cycles_flip = flips[0]
        if shown_result.result is not None and shown_result.result.folder == job:
            for name in shown_result.CHECKED[: 2 * len(flips)]:
                previews.show(name, job / "pictures")

    folder = make_folder("check")
    engine = engine_name(bpy.context.scene.render.engine)
    alone = engine == "Cycles" or not bpy.app.binary_path  # the module may have no graphics
    steps = []
    for name, label in (("cycles", "Cycles"), ("engine", engine))[: 1 if alone else 2]:
        picture = folder / f"{name}.exr"
        words = ["--job", str(job), "--material", material, "--out", str(picture)]
        words += ["--engine", "scene"] if name == "engine" else []
        judge = [str(python), "-m", "mfo_backend", "judge", str(job), str(picture), "--name", name, "--json"]
        steps.append(_blender_step(folder, "check", words, f"Rendering in {label}"))
        steps.append(Step(judge, backend_environment(EXTENSION_ROOT), "Comparing"))
    _begin(folder, steps, done)


def render_reference(out: Path, number: int, words: Sequence[str]) -> None:
    """Render the scene in Cycles into the scene-linear EXR `out` and make it the reference.

    `number` counts the pictures of the list from 1. `words` are further options of the command `render` of
    `headless.py`: what of the scene is rendered.

    Raises
    ------
    OSError
        If no copy of the scene can be written or no Blender can be started.
    """

    def done(_answers: list[dict[str, Any]]) -> None:
        _runtime().cycles_text = ""
        window = next(iter(bpy.context.window_manager.windows), None)
        with bpy.context.temp_override(**({"window": window} if window else {})):
            bpy.ops.mfo.use_reference("EXEC_DEFAULT", True, filepath=str(out), number=number)

    out.parent.mkdir(parents=True, exist_ok=True)
    folder = make_folder("check")
    step = _blender_step(folder, "render", ["--out", str(out), *words], "Rendering the reference")
    _begin(folder, [step], done, of_reference=True)


def step() -> bool:
    """See how far it is; False when nothing runs any more."""
    global _current
    if _current is None:
        return False
    running, runtime = _current, _runtime()
    running.task.poll()
    if running.task.is_running:
        text = running.task.progress()
        if text != runtime.cycles_text:
            runtime.cycles_text = text
            redraw()
        return True
    _current = None
    atexit.unregister(close)
    answers = running.task.answers
    if running.task.sentence and len(answers) < 2:
        runtime.cycles_text, runtime.cycles_flip = running.task.sentence, -1.0
    elif running.task.sentence:  # Cycles has answered, the scene's own engine has not
        running.done(answers[:2])
        runtime.cycles_text += f". {running.task.sentence}"
    else:
        running.done(running.task.answers)
    shutil.rmtree(running.folder, ignore_errors=True)
    redraw()
    return False


def wait() -> None:
    """Step until it has ended."""
    while step():
        time.sleep(0.1)


def close() -> None:
    """Kill what runs and remove its files."""
    global _current
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    atexit.unregister(close)
    if _current is not None:
        _current.task.close()
        shutil.rmtree(_current.folder, ignore_errors=True)
        _current = None


def _begin(
    folder: Path, steps: list[Step], done: Callable[[list[dict[str, Any]]], None], *, of_reference: bool = False
) -> None:
    global _current
    try:
        save_copy(folder / "scene.blend")
        _current = _Running(BackgroundTask(steps, folder), folder, done)
    except OSError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    atexit.register(close)
    runtime = _runtime()
    runtime.cycles_text, runtime.cycles_flip, runtime.cycles_of_reference = steps[0].label, -1.0, of_reference
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TASK_TICK, persistent=True)
    redraw()


def _blender_step(folder: Path, command: str, words: list[str], label: str) -> Step:
    """One command of `headless.py` on a copy of the scene, by this Blender's program or module."""
    arguments = [command, str(folder / "scene.blend"), *words, "--samples", "0", "--parent", str(os.getpid())]
    if bpy.app.binary_path:
        script = str(Path(__file__).resolve().parents[1] / "headless.py")
        options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python", script, "--"]
        return Step([bpy.app.binary_path, *options, *arguments], environment_for(EXTENSION_ROOT), label)
    module = [sys.executable, "-m", "blender_addon.headless"]
    return Step([*module, *arguments], environment_for(EXTENSION_ROOT), label)


def _tick() -> float | None:
    return TASK_TICK if step() else None


def _runtime() -> bpy.types.PropertyGroup:
    return bpy.context.window_manager.mfo_runtime
