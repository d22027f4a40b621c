# SPDX-License-Identifier: GPL-3.0-or-later
"""The one fit of this Blender: drives its process and tells the panel through WindowManager.mfo_runtime.

In windows a timer calls `step`; in background mode, where timers never fire, `wait` does. Nothing here keeps a Blender
object between two steps, because undo and file load replace them.
"""

from __future__ import annotations

import atexit
import shutil
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import bpy

from . import previews
from .job_process import Event, JobProcess, Outcome
from .job_result import JobResult, JobResultError, Value, read_job_result
from .write_back import WriteBackError, result_to_sockets, socket_to_parameter

TICK = 0.15  # seconds between two looks at the process
_PICTURES = ("reference", "start", "result", "difference")
_GOOD = {"converged", "stale", "unchanged", "max_iterations"}
_ERROR_LABELS = {"flip": "FLIP", "hdr_flip": "HDR-FLIP", "mse": "MSE"}


@dataclass
class RunningJob:
    """A fit in progress and what is known of it so far."""

    process: JobProcess
    material_name: str
    material_uid: int
    notes: Sequence[str]
    is_new: bool


current: RunningJob | None = None
result: JobResult | None = None
material_uid = 0  # of the material `result` belongs to, 0 when it came from another session


def start(
    process: JobProcess,
    material: bpy.types.Material,
    reference: Path,
    notes: Sequence[str],
    *,
    is_new: bool,
    timer: bool,
) -> None:
    """Take over a started process; `is_new`: its folder was made for it; `timer`: look after it while Blender runs."""
    global current, result
    result = None
    current = RunningJob(process, material.name, material.session_uid, tuple(notes), is_new)
    atexit.register(close)
    runtime = _runtime()
    _clear(runtime)
    previews.clear()
    runtime.state, runtime.material, runtime.job_folder = "RUNNING", material.name, str(process.folder)
    runtime.progress_text = "Starting"
    previews.show("reference", reference)
    for note in notes:
        add_message(runtime, note, "INFO")
    if timer and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK, persistent=True)


def step() -> Outcome | None:
    """Handle what the backend said since the last step; its outcome when it has ended, else None."""
    job = current
    if job is None:
        return None
    for event in job.process.poll():
        _handle(job, event)
    outcome = job.process.outcome
    if outcome is not None:
        _finish(job, outcome)
    return outcome


def wait(tell: Callable[[str], None]) -> Outcome:
    """Step until the fit ends; `tell` gets a line of progress about every second."""
    told, seen = 0.0, ""
    while (outcome := step()) is None:
        text = f"{_runtime().progress_text} · {_runtime().detail}"
        if text != seen and time.monotonic() - told > 1.0:
            told, seen = time.monotonic(), text
            tell(text)
        time.sleep(0.05)
    return outcome


def cancel() -> None:
    """Ask the fit to stop; what it has found so far is kept."""
    if current is not None:
        current.process.cancel()
        runtime = _runtime()
        runtime.state, runtime.progress_text = "CANCELLING", "Cancelling"
        redraw()


def close() -> None:
    """End a running fit within about a second and stop the timer."""
    global current
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    atexit.unregister(close)
    if current is not None:
        current.process.close()
        current = None


def reset() -> None:
    """Forget the last fit: its result, pictures and messages."""
    global result, material_uid
    result, material_uid = None, 0
    previews.clear()
    _clear(_runtime())


def show_result(found: JobResult, uid: int) -> None:
    """Make `found` the result that panel and `mfo.apply` use; `uid` is its material's session_uid or 0."""
    global result, material_uid
    result, material_uid = found, uid
    runtime = _runtime()
    runtime.checked = False
    runtime.has_result, runtime.job_folder, runtime.material = True, str(found.folder), found.material_name
    for name, (before, after) in found.errors.items():
        _add_row(runtime.errors, _ERROR_LABELS.get(name, name), before, after)
    for name, value in result_to_sockets(found).items():
        _add_row(runtime.values, name, found.sockets_start.get(name), value)
        runtime.values[-1].certainty = found.certainty.get(socket_to_parameter(name), "")
    for note in found.notes:
        if note not in runtime.messages:
            add_message(runtime, note, "INFO")
    for name in _PICTURES:
        previews.show(name, found.folder / "pictures" / f"{name}.png")


def fail(sentences: Sequence[str]) -> None:
    """Show errors that kept a fit from starting."""
    runtime = _runtime()
    _clear(runtime)
    runtime.state = "FAILED"
    runtime.sentence = sentences[0] if sentences else ""
    for sentence in sentences[1:]:
        add_message(runtime, sentence, "ERROR")
    redraw()


def add_message(runtime: bpy.types.PropertyGroup, text: str, icon: str) -> None:
    """Add one line to the panel's list."""
    message = runtime.messages.add()
    message.name, message.icon = text, icon


def _tick() -> float | None:
    return TICK if current is not None and step() is None else None


def _handle(job: RunningJob, event: Event) -> None:
    runtime = _runtime()
    try:
        if event["event"] == "progress":
            runtime.fraction = float(event["fraction"])
            if not job.process.cancelling:
                runtime.progress_text = progress_text(event)
            runtime.detail = f"{event['stage']}, iteration {event['iteration']}, loss {float(event['best']):.4g}"
        elif event["event"] == "preview":
            path = (job.process.folder / event["path"]).resolve()
            if path.is_relative_to(job.process.folder.resolve()):
                previews.show("current", path)
        elif event["event"] == "stage_end":
            line = "{stage}: {loss_start:.3g} to {loss_best:.3g}, {iterations} iterations ({status})"
            add_message(runtime, line.format_map(event), "CHECKMARK")
    except (KeyError, TypeError, ValueError, OverflowError, OSError, RuntimeError):
        return  # a newer backend says less or more than we know; its result is what counts
    redraw()


def progress_text(event: Event) -> str:
    """Stage, percent and time left of a progress event, short enough for a progress bar."""
    text = f"Stage {event['stage_index'] + 1}/{event['stage_count']} · {event['fraction']:.0%}"
    left = event.get("remaining_seconds")
    return text if left is None else f"{text} · {_duration(float(left))} left"


def _finish(job: RunningJob, outcome: Outcome) -> None:
    global current
    runtime = _runtime()
    current = None
    atexit.unregister(close)
    _remove_unfinished(job.process.folder)
    runtime.state = "DONE" if outcome.status in _GOOD else "FAILED"
    runtime.sentence = outcome.sentence
    runtime.progress_text, runtime.detail = "", ""
    try:
        if outcome.status in _GOOD or (job.process.folder / "result.json").is_file():
            show_result(read_job_result(job.process.folder), job.material_uid)
            runtime.state = "DONE"
    except (JobResultError, WriteBackError) as error:
        runtime.state, runtime.sentence = "FAILED", f"{outcome.sentence} {error}"
    if outcome.status == "bad_input" and job.is_new and not runtime.has_result:
        shutil.rmtree(job.process.folder, ignore_errors=True)  # bad input leaves things as they were
        runtime.job_folder = ""
    redraw()


def _remove_unfinished(folder: Path) -> None:
    """Remove files that the backend was killed in the middle of."""
    for parent in (folder, folder / "pictures"):
        for path in parent.glob(".*.tmp"):
            with suppress(OSError):
                path.unlink()


def _clear(runtime: bpy.types.PropertyGroup) -> None:
    for name in (
        "state",
        "material",
        "job_folder",
        "sentence",
        "fraction",
        "progress_text",
        "detail",
        "has_result",
        "checked",
    ):
        runtime.property_unset(name)
    for rows in (runtime.messages, runtime.values, runtime.errors):
        rows.clear()


def _runtime() -> bpy.types.PropertyGroup:
    return bpy.context.window_manager.mfo_runtime


def redraw() -> None:
    """Have the sidebar drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _add_row(rows: bpy.types.bpy_prop_collection, label: str, before: Value | None, after: Value) -> None:
    row = rows.add()
    row.name = label
    row.start, row.result = _shown(before), _shown(after)


def _shown(value: Value | None) -> str:
    if value is None:
        return ""
    if isinstance(value, tuple):
        return previews.swatch(value)
    return f"{value:.3g}"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(max(0.0, seconds)), 60)
    return f"{minutes} m {rest:02d} s" if minutes else f"{rest} s"
