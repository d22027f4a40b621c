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

from ..backend.preferences import idle_seconds
from ..check import preflight
from ..check.preflight import redraw
from ..pictures import previews
from ..process import waiting_backend
from ..process.job_process import JobProcess, Outcome
from ..process.own_blender import SERVER, own_blender
from ..process.progress_lines import Event
from ..result import history, shown_result
from ..result.job_result import JobResult, JobResultError, read_job_result, result_folders
from ..result.local_copy import unwritable
from ..result.shown_result import add_message
from ..result.write_back import WriteBackError
from ..versions import is_modal_operator_running
from . import fit_queue, kept_results, notice
from .fit_queue import PreparedFit

TICK = 0.1  # seconds between two looks at the process
MODAL_LOOKS = 60  # looks at a modal operator before a result goes into its history without an undo step
_FIRST_STAGES = ("scan", "start")  # they look for a place to begin; every other stage refines
_FIRST_GUESS = 0.05  # share from which on the time left is more than a guess
_GOOD = {"converged", "stale", "unchanged", "max_iterations"}
_CANCELLED = "cancelled"  # before there was a result, nothing has failed
_ENDED = _GOOD | {"different"}  # the fit came to its end, whatever it found


@dataclass
class RunningJob:
    """A fit in progress."""

    process: JobProcess
    fit: PreparedFit


current: RunningJob | None = None
_left = ""  # folder of a fit that ended with its file, which was never saved
unrecorded: list[tuple[JobResult, int]] = []  # results with their material's session_uid, not in its history yet
_refused: object = None  # what was checked when a fit was refused last
_is_listed = False  # whether the check listed why
_patience = MODAL_LOOKS


def start(fit: PreparedFit, *, timer: bool) -> None:
    """Start the backend on a job folder; with `timer` look after it, and then the queue, while Blender runs.

    Raises
    ------
    OSError
        If the backend cannot be started.
    """
    global current
    current = RunningJob(
        JobProcess(
            fit.python,
            fit.folder,
            blender=own_blender(SERVER, []),
            waiting=waiting_backend.take(fit.python),
        ),
        fit,
    )
    atexit.register(close)
    runtime = _runtime()
    shown_result.clear(runtime)
    runtime.state, runtime.material, runtime.job_folder = "RUNNING", fit.material_name, str(fit.folder)
    runtime.progress_text = "Starting"
    for note in fit.notes:
        add_message(runtime, note, "INFO")
    if timer:
        kept_results.keep(fit.folder)
        if not bpy.app.timers.is_registered(_tick):
            bpy.app.timers.register(_tick, first_interval=TICK, persistent=True)
    redraw()


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
    """End a running fit within about a second, empty the queue and stop the timer; what it has found is kept."""
    global current
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    atexit.unregister(close)
    fit_queue.clear()
    unrecorded.clear()
    if current is not None:
        current.process.close()
        current = None


def close_for_load() -> str:
    """`close` before another file is opened; returns what is to be said of the fits that end with it."""
    return _close_and_say("The fit of {} was ended as another file was opened.", bpy.data.filepath)


def close_for_disable() -> None:
    """`close` before the add-on is switched off; when it is on again, the panel says so."""
    said = _close_and_say("The fit of {} was ended as the add-on was switched off.", "")
    if said:
        reset(said)


def _close_and_say(why: str, blend: str) -> str:
    """`close`; what is to be said of the fits that end with it, whose values come back with the file `blend`."""
    global _left
    _left = ""
    job, waiting = current, len(fit_queue.waiting)
    close()
    if job is None:
        return ""
    said = [why.format(job.fit.material_name)]
    if not (job.process.folder / "result.json").is_file():
        said.append("It had found no values yet.")
    elif blend:
        said.append(f"Its best values so far are in the history when {Path(blend).name} is opened again.")
    else:
        _left = str(job.process.folder)
        said.append(f"Load Result shows its best values so far, from its folder: {job.process.folder}")
    if waiting:
        said.insert(1, f"Fits of the queue that were not begun: {waiting}.")
    return " ".join(said)


def reset(sentence: str = "") -> None:
    """Forget the last fit: its result, pictures and messages; `sentence` is said of the file that was left."""
    runtime = _runtime()
    shown_result.clear(runtime)
    runtime.sentence, runtime.job_folder = sentence, _left if sentence else ""


def folders() -> list[Path]:
    """Job folders of the fit that runs and of those that wait; they are the open file's."""
    running = [current.process.folder] if current is not None else []
    return running + [fit.folder for fit in fit_queue.waiting]


def fail(sentences: Sequence[str]) -> None:
    """Show errors that kept a fit from starting; make the check that lists them before."""
    global _refused, _is_listed
    runtime = _runtime()
    if current is None:
        shown_result.clear(runtime)
        runtime.state = "FAILED"
        _refused = preflight.look(bpy.context.scene, bpy.context.view_layer)
        _is_listed = any(map(preflight.lists, sentences))
    runtime.sentence = sentences[0] if sentences else ""
    for sentence in sentences[1:]:
        add_message(runtime, sentence, "ERROR")
    redraw()


def forget_refusal() -> None:
    """Say nothing any more of what kept an earlier fit from starting, or of a file that was left."""
    runtime = _runtime()
    if current is not None:
        runtime.sentence = ""
    elif not runtime.has_result:
        shown_result.clear(runtime)


def is_answered(context: bpy.types.Context) -> bool:
    """Whether the last fit was refused for what has been changed since, so that nothing of it need be said any more."""
    runtime = _runtime()
    if runtime.state != "FAILED" or runtime.job_folder:
        return False
    is_mended = _is_listed and not preflight.lists(runtime.sentence)
    return is_mended or _refused != preflight.look(context.scene, context.view_layer)


def record_results() -> int:
    """Put the results that are not there yet into the histories of their materials; returns how many found theirs."""
    count = 0
    materials = {material.session_uid: material for material in bpy.data.materials}
    for result, uid in unrecorded:
        material = materials.get(uid)
        if material is not None and not unwritable(material):
            history.record(material, result)
            count += 1
    unrecorded.clear()
    return count


def _tick() -> float | None:
    if current is not None:
        step()
    if current is None:
        _record_as_undo_step()
        _start_next()
    return TICK if current is not None or fit_queue.waiting or unrecorded else None


def _record_as_undo_step() -> None:
    """A change from a timer that undo does not know would be lost with the next undo."""
    global _patience
    window = next(iter(bpy.context.window_manager.windows), None)
    if not unrecorded or window is None:
        return
    if not is_modal_operator_running():
        with bpy.context.temp_override(window=window):
            bpy.ops.mfo.record_results("EXEC_DEFAULT", True)
    elif _patience > 0:  # an undo step in the middle of somebody's drag would cut it in two
        _patience -= 1
        return
    else:
        record_results()
    _patience = MODAL_LOOKS


def _start_next() -> None:
    fit = None if unrecorded else fit_queue.take()
    if fit is None:
        return
    try:
        start(fit, timer=True)
    except OSError as error:
        fit_queue.ended(fit.material_name, f"The backend could not be started ({error.strerror or error}).", "ERROR")
        redraw()


def _handle(job: RunningJob, event: Event) -> None:
    runtime = _runtime()
    try:
        if event["event"] == "progress":
            runtime.fraction = float(event["fraction"])
            if not job.process.cancelling:
                runtime.progress_text = progress_text(event)
            runtime.detail = f"{event['stage']} · step {event['iteration']} · error {float(event['best']):.3g}"
        elif event["event"] == "stage_end":
            if not (job.process.cancelling or _looks_for_a_start(event)):  # another stage may follow, and will say so
                runtime.progress_text = "Checking the values"
        elif event["event"] == "preview":
            for key, name in (("path", "current"), ("reference", "reference"), ("difference", "difference")):
                if key in event:
                    _show_preview(job, name, event[key])
    except (KeyError, TypeError, ValueError, OverflowError, OSError, RuntimeError):
        return  # a newer backend says less or more than we know; its result is what counts
    redraw()


def _show_preview(job: RunningJob, name: str, relative: str) -> None:
    path = (job.process.folder / relative).resolve()
    if path.is_relative_to(job.process.folder.resolve()):
        previews.show_thumbnail(name, path)


def progress_text(event: Event) -> str:
    """What is done, percent and time left of a progress event, short enough for a progress bar."""
    text = f"{'Exploring' if _looks_for_a_start(event) else 'Refining'} · {event['fraction']:.0%}"
    left = event.get("remaining_seconds")
    if left is None or float(event["fraction"]) < _FIRST_GUESS:
        return text
    return f"{text} · {_duration(float(left))} left"


def _looks_for_a_start(event: Event) -> bool:
    return event["stage"].rpartition(": ")[2] in _FIRST_STAGES  # of several materials, after the name of one


def _finish(job: RunningJob, outcome: Outcome) -> None:
    global current, _refused, _is_listed
    runtime = _runtime()
    current = None
    atexit.unregister(close)
    _remove_unfinished(job.process.folder)
    runtime.state = "DONE" if outcome.status in _ENDED else "IDLE" if outcome.status == _CANCELLED else "FAILED"
    runtime.sentence = outcome.sentence
    runtime.progress_text, runtime.detail = "", ""
    try:
        if outcome.status in _ENDED or (job.process.folder / "result.json").is_file():
            folders = result_folders(job.process.folder)
            results = [(read_job_result(path), uid) for path, uid in zip(folders, job.fit.uids, strict=False)]
            shown_result.show_all(results)
            unrecorded.extend(results)
            found = results[0][0]
            died = found.partial and found.status == "failed"  # its sentence says so beside what can be applied
            runtime.state = "FAILED" if died else "DONE"
    except (JobResultError, WriteBackError) as error:
        runtime.state, runtime.sentence = "FAILED", f"{outcome.sentence} {error}"
    if runtime.state == "IDLE":
        runtime.job_folder = ""  # there is nothing to load
    if not runtime.has_result:
        kept_results.forget(job.process.folder)
    icon = "ERROR" if runtime.state == "FAILED" else shown_result.VERDICT_ICONS.get(runtime.verdict, "INFO")
    fit_queue.ended(job.fit.material_name, runtime.sentence, icon)
    if outcome.status == "bad_input" and job.fit.is_new and not runtime.has_result:
        shutil.rmtree(job.process.folder, ignore_errors=True)  # bad input leaves things as they were
        runtime.job_folder = ""
        _is_listed = False
        _refused = preflight.look(bpy.context.scene, bpy.context.view_layer)
    if bpy.app.background:
        record_results()
    else:
        waiting_backend.prepare(job.fit.python, idle_seconds(bpy.context), own_blender(SERVER, []))
        notice.tell(runtime.sentence)
    redraw()


def _remove_unfinished(folder: Path) -> None:
    """Remove files that the backend was killed in the middle of."""
    for parent in (folder, folder / "pictures"):
        for path in parent.glob(".*.tmp"):
            with suppress(OSError):
                path.unlink()


def _runtime() -> bpy.types.PropertyGroup:
    return bpy.context.window_manager.mfo_runtime


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(max(0.0, seconds)), 60)
    return f"{minutes} m {rest:02d} s" if minutes else f"{rest} s"
