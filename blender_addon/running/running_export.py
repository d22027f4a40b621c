# SPDX-License-Identifier: GPL-3.0-or-later
"""An export that waits for a second Blender while this one stays usable: a timer takes its steps.

The scene is read in the first step, at once. What the steps hold of Blender's data does not outlive an undo or another
file, so both end it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass

import bpy

from ..check.preflight import redraw
from . import running_job
from .fit_queue import PreparedFit

TICK = 0.1  # seconds between two steps
_UNDONE = "The export was ended by an undo or another file: press Fit again."
_GONE = "Something that was being exported is not in the file any more: press Fit again."


@dataclass
class RunningExport:
    """The steps, the scene and view layer they need as context, and who gets what they return."""

    steps: Generator[None, None, PreparedFit]
    scene: str
    view_layer: str
    then: Callable[[PreparedFit], None]
    began: float


current: RunningExport | None = None


def start(
    context: bpy.types.Context, steps: Generator[None, None, PreparedFit], then: Callable[[PreparedFit], None]
) -> None:
    """Take the first step; where it does not end there, a timer takes the others. Errors of the first are raised."""
    global current
    try:
        next(steps)
    except StopIteration as end:
        then(end.value)
        return
    current = RunningExport(steps, context.scene.name, context.view_layer.name, then, time.monotonic())
    bpy.app.timers.register(_tick, first_interval=TICK)
    redraw()


def seconds() -> float:
    """How long it has taken so far."""
    return time.monotonic() - current.began if current is not None else 0.0


def close(sentence: str = "") -> None:
    """End it, with its Blender and what it has written; `sentence` says why, where the user did not ask for it."""
    global current
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if current is not None:
        current.steps.close()
        current = None
        if sentence:
            running_job.fail([sentence])


def undone() -> None:
    """To be called before an undo, and before another file is opened."""
    close(_UNDONE)


def _tick() -> float | None:
    global current
    job = current
    if job is None:
        return None
    try:
        window = bpy.context.window_manager.windows[0]
        scene = bpy.data.scenes[job.scene]
        with bpy.context.temp_override(window=window, scene=scene, view_layer=scene.view_layers[job.view_layer]):
            next(job.steps)
    except StopIteration as end:
        current = None
        _hand_over(job, end.value)
        return None
    except (ReferenceError, KeyError):
        close(_GONE)
        return None
    except Exception as error:  # a timer that raises is never called again, and nobody would be told
        current = None
        running_job.fail([str(error)])
        return None
    redraw()  # the seconds go on
    return TICK


def _hand_over(job: RunningExport, fit: PreparedFit) -> None:
    try:
        job.then(fit)
    except Exception as error:
        running_job.fail([str(error)])
