# SPDX-License-Identifier: GPL-3.0-or-later
"""Live: a new fit from the present values when the reference, what counts of it, a limit or a lock has changed."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy

from ..check import preflight
from . import running_export, running_job

SCENE_TICK = 0.2  # seconds between two looks at the scene
SETTLED = 0.6  # seconds without a further change, so that a drag is one fit

_seen: Any = None  # what the next fit depends on, as it was when it was looked at last
_changed: float | None = None  # when it changed, on the monotonic clock; None where the last fit knows it


def watch(context: bpy.types.Context) -> None:
    """Called while drawing: look after the settings as long as Live is on."""
    if context.scene.mfo.live and not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        forget(context.scene, context.view_layer)
        bpy.app.timers.register(_tick, first_interval=SCENE_TICK)


def forget(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Take the settings as they are for known."""
    global _seen, _changed
    _seen, _changed = _look(scene, view_layer), None


def is_due(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, now: float) -> bool:
    """Whether something has changed, and not since a moment; a fit that runs ends first. `now` is in seconds."""
    global _seen, _changed
    look = _look(scene, view_layer)
    if look != _seen:
        _seen, _changed = look, now
    if _changed is None or now - _changed < SETTLED:
        return False
    if running_job.current is not None or running_export.current is not None:
        return False
    _changed = None
    return True


def close() -> None:
    """Stop the timer."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


def _tick() -> float | None:
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None or not window.scene.mfo.live:
        return None
    if is_due(window.scene, window.view_layer, time.monotonic()):
        with bpy.context.temp_override(window=window), suppress(RuntimeError):
            preflight.check_now(window.scene, window.view_layer)  # it lists what stops the fit
            preflight.redraw()
            if bpy.ops.mfo.fit.poll() and not preflight.refusal(bpy.context):
                bpy.ops.mfo.fit("EXEC_DEFAULT", True)
    return SCENE_TICK


def _look(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Any:
    """What a user sets for the next fit; a file that was written anew is another picture."""
    settings, target = scene.mfo, view_layer.objects.active
    path = Path(bpy.path.abspath(settings.reference_path)) if settings.reference_path else None
    written = None
    with suppress(OSError):
        written = path.stat().st_mtime if path is not None else None
    parts = [
        (one.use, one.path, tuple(one.part.crop), getattr(one.part.mask, "name", ""), one.part.use_alpha)
        for one in (settings.first_picture, *settings.pictures)
    ]
    return (
        target and (target.name, getattr(target.active_material, "name", "")),
        (settings.reference_source, settings.reference_path, written, getattr(settings.reference_image, "name", "")),
        (settings.reference_view, settings.parameter_set, settings.model, settings.preset),
        (frozenset(settings.sockets), frozenset(settings.parameters), tuple(v.name for v in settings.node_values)),
        [(bound.name, bound.lower, bound.upper) for bound in settings.bounds],
        parts,
    )
