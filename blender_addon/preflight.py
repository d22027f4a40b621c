# SPDX-License-Identifier: GPL-3.0-or-later
"""The check before a run as the panel shows it: made by a timer after something changed, never while drawing."""

from __future__ import annotations

from typing import Any

import bpy

from .checks import IGNORED, STOPS, TO_CHOOSE, Finding, quick_check

DELAY = 0.25  # seconds between a change and its check, so that a drag costs four checks a second at most

findings: tuple[Finding, ...] = ()  # what the panel lists
is_thorough = False  # they come from a whole export, by `mfo.check`
_quick: tuple[Finding, ...] = ()  # the last quick check, without what an export said
_seen: Any = None  # what the scene looked like then
_checked = False


def watch(context: bpy.types.Context) -> None:
    """Called while drawing: have a check made soon if there was none, or something it looks at has changed."""
    if not _checked or _seen != _look(context.scene, context.view_layer):
        request()


def request() -> None:
    """Have a check made soon."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_run):
        bpy.app.timers.register(_run, first_interval=DELAY)


def check_now(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Make the quick check; what an export said stays as long as the quick check says the same as before."""
    global findings, is_thorough, _quick, _seen, _checked
    found = quick_check(scene, view_layer)
    _seen, _checked = _look(scene, view_layer), True
    if found != _quick:
        findings, is_thorough, _quick = found, False, found


def show_thorough(found: tuple[Finding, ...]) -> None:
    """Show the lines of a whole export instead; call `check_now` before."""
    global findings, is_thorough
    findings, is_thorough = found, True


def by_export() -> tuple[Finding, ...]:
    """What is ignored according to an export, and the quick check does not know: long sentences, rarely news."""
    return tuple(finding for finding in findings if finding.level == IGNORED and finding not in _quick)


def count(level: str) -> int:
    """How many lines have this level."""
    return sum(finding.level == level for finding in findings)


def summary() -> tuple[str, str]:
    """Words and icon for the heading of the list."""
    stops, ignored = count(STOPS), count(IGNORED)
    if not _checked:
        return "Check", "BLANK1"
    if stops:
        return f"Check: {stops} to mend", "ERROR"
    if count(TO_CHOOSE):
        return "Check: no picture yet", "INFO"
    return ("Check: ready", "CHECKMARK") if not ignored else (f"Check: ready, {ignored} ignored", "INFO")


def reset() -> None:
    """Forget everything and stop the timer."""
    global findings, is_thorough, _quick, _seen, _checked
    findings, is_thorough, _quick, _seen, _checked = (), False, (), None, False
    if bpy.app.timers.is_registered(_run):
        bpy.app.timers.unregister(_run)


def _run() -> None:
    context = bpy.context
    if context.scene is None or context.view_layer is None:
        return
    before = findings
    check_now(context.scene, context.view_layer)
    if findings != before:
        redraw()


def redraw() -> None:
    """Have every place drawn again that shows the panels."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "PROPERTIES"):
                area.tag_redraw()


def _look(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Any:
    """What can change without the depsgraph saying so, cheap enough for every draw."""
    settings, render, view = scene.mfo, scene.render, scene.view_settings
    target = view_layer.objects.active
    return (
        scene.name,
        target and (target.name, target.active_material_index, getattr(target.active_material, "name", "")),
        scene.camera and scene.camera.name,
        (render.resolution_x, render.resolution_y, render.resolution_percentage, render.use_border, render.engine),
        (render.image_settings.color_management, render.image_settings.file_format),
        (render.use_multiview, view.view_transform, view.look, view.use_curve_mapping),
        (settings.reference_source, settings.reference_path, getattr(settings.reference_image, "name", "")),
        (
            scene.display_settings.display_device,
            settings.reference_view,
            settings.animated,
            settings.parameter_set,
            settings.model,
            frozenset(settings.sockets),
        ),
        [(bound.name, bound.lower, bound.upper) for bound in settings.bounds],
    )
