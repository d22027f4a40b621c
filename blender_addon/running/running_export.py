# SPDX-License-Identifier: GPL-3.0-or-later
"""An export that gives the windows back between its steps, which a timer takes.

What the steps hold of Blender's data does not outlive an undo or another file, so both end it. What is still to be read
must be as it was when the user pressed, so a change ends it then.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..check.preflight import look_at_scene, redraw
from ..export.steps import STEP_SECONDS, Found, Pause, Steps, advance
from . import running_job

AT_ONCE = 1.0  # seconds that a press may take: the export of a plain scene is done then, and its fit has begun
DRAWN = 0.01  # seconds that Blender has to draw where nothing is waited for
_UNDONE = "The export was ended by an undo or another file: press Fit again."
_GONE = "Something that was being exported is not in the file any more: press Fit again."
_CHANGED = "The scene was changed while it was read for the fit: press Fit again, and leave it as it is meanwhile."


@dataclass
class RunningExport:
    """The steps, the scene and view layer they need as context, and who gets what they return."""

    steps: Steps[Any]
    scene_uid: int
    view_layer: str
    then: Callable[[Any], None]
    began: float
    pause: Pause
    seen: object  # settings that no update of the depsgraph tells of
    is_changed: bool = False


current: RunningExport | None = None
_is_stepping = False  # what changes then is the export's own doing


def start(context: bpy.types.Context, steps: Steps[Found], then: Callable[[Found], None]) -> None:
    """Take the first steps; where they do not end there, a timer takes the others. Errors of the first are raised."""
    global current
    seen = _look(context.scene)
    try:
        pause = _advance(steps, context.view_layer, AT_ONCE)
    except StopIteration as end:
        then(end.value)
        return
    uid, layer = context.scene.session_uid, context.view_layer.name
    current = RunningExport(steps, uid, layer, then, time.monotonic(), pause, seen)
    bpy.app.timers.register(_tick, first_interval=_interval(pause))
    running_job.forget_refusal()
    redraw()


def seconds() -> float:
    """How long it has taken so far."""
    return time.monotonic() - current.began if current is not None else 0.0


def progress() -> tuple[float | None, str]:
    """How much of it is done and what is being done; None and empty where that is not known."""
    return (current.pause.share, current.pause.text) if current is not None else (None, "")


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


def changed(depsgraph: bpy.types.Depsgraph) -> None:
    """To be called after an update of the depsgraph: the next step ends an export that has not read everything."""
    if current is None or _is_stepping or not current.pause.holds_scene:
        return
    current.is_changed |= any(map(_tells_of_a_change, depsgraph.updates))


def _tells_of_a_change(update: bpy.types.DepsgraphUpdate) -> bool:
    """Not of what is selected, nor of a frame or camera that was put back: these are of scene and objects, as shading.

    Settings of the scene are compared.
    """
    if isinstance(update.id, bpy.types.Scene):
        return False
    is_shaded = update.is_updated_shading and not isinstance(update.id, bpy.types.Object)
    return update.is_updated_geometry or update.is_updated_transform or is_shaded


def _tick() -> float | None:
    global current, _is_stepping
    job = current
    if job is None:
        return None
    try:
        scene = {each.session_uid: each for each in bpy.data.scenes}[job.scene_uid]  # it may have another name
        view_layer = scene.view_layers[job.view_layer]
        if job.pause.holds_scene and (job.is_changed or _look(scene) != job.seen):
            close(_CHANGED)
            return None
        if job.pause.is_over():
            window = bpy.context.window_manager.windows[0]
            _is_stepping = True
            with bpy.context.temp_override(window=window, scene=scene, view_layer=view_layer):
                job.pause = _advance(job.steps, view_layer, STEP_SECONDS)
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
    finally:
        _is_stepping = False
    redraw()  # the seconds go on
    return _interval(job.pause)


def _advance(steps: Steps[object], view_layer: bpy.types.ViewLayer, seconds: float) -> Pause:
    """Steps with what they put back: else Blender's next update would tell of it as of a change by the user."""
    pause = advance(steps, seconds)
    if pause.holds_scene:
        view_layer.update()
    return pause


def _look(scene: bpy.types.Scene) -> object:
    """What an export reads of the scene and its objects, and no update of the depsgraph tells of."""
    slots = np.empty(len(scene.objects), dtype=np.int32)
    scene.objects.foreach_get("active_material_index", slots)
    return look_at_scene(scene), slots.tobytes()


def _interval(pause: Pause) -> float:
    return DRAWN if pause.is_over() else running_job.TICK


def _hand_over(job: RunningExport, found: object) -> None:
    try:
        job.then(found)
    except Exception as error:
        running_job.fail([str(error)])
