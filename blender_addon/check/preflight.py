# SPDX-License-Identifier: GPL-3.0-or-later
"""The check before a run as the panel shows it: made by a timer after something changed, never while drawing."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import bpy

from .checks import quick_check
from .finding import IGNORED, STOPS, TO_CHOOSE, Finding, first_refused

_WITH_PANELS = {("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW")}  # areas and their regions
FILES_LAST = 2.0  # seconds after which chosen files are looked at again: they may be on a drive that answers slowly
DELAY = 0.25  # seconds between a change and its check, so that a drag costs four checks a second at most

findings: tuple[Finding, ...] = ()  # what the panel lists
mended: tuple[Finding, ...] = ()  # what buttons have mended since the list last changed otherwise
is_thorough = False  # they come from a whole export, by `mfo.check`
_before: tuple[Finding, ...] = ()  # the list that the first of those buttons was pressed in
_quick: tuple[Finding, ...] = ()  # the last quick check, without what an export said
_seen: Any = None  # what the scene looked like then
_checked = False
_files: Any = None  # states of the chosen files then
_files_looked = -math.inf  # when they were looked at last, on the monotonic clock


def watch(context: bpy.types.Context) -> None:
    """Called while drawing: have a check made soon if there was none, or something it looks at has changed."""
    if not _checked or _seen != look(context.scene, context.view_layer):
        request()
    is_old = time.monotonic() - _files_looked > FILES_LAST
    if is_old and not bpy.app.background and not bpy.app.timers.is_registered(look_at_files):
        bpy.app.timers.register(look_at_files, first_interval=0.0)


def look_at_files() -> None:
    """Have a check made soon if a chosen picture was written anew, moved or removed since the last one."""
    global _files_looked
    _files_looked = time.monotonic()
    if _checked and _files != _chosen_files(bpy.context.scene):
        request()


def _chosen_files(scene: bpy.types.Scene) -> dict[str, tuple[int, int] | None]:
    """The states of the pictures that a scene has chosen."""
    settings = scene.mfo
    paths = (settings.reference_path, *(one.path for one in settings.pictures))
    return {path: _state_of(path) for path in paths if path}


def _state_of(given: str) -> tuple[int, int] | None:
    """Time and size of a file, None where there is none."""
    try:
        found = Path(bpy.path.abspath(given)).stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size


def request() -> None:
    """Have a check made soon."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_run):
        bpy.app.timers.register(_run, first_interval=DELAY)


def check_now(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Make the quick check; what an export said stays as long as the quick check says the same as before."""
    global findings, is_thorough, mended, _before, _quick, _seen, _checked, _files
    _files = _chosen_files(scene)  # before they are read: what is written meanwhile is seen by the next look
    found = quick_check(scene, view_layer)
    _seen, _checked = look(scene, view_layer), True
    if found != _quick:
        findings, is_thorough, _quick = found, False, found
        mended = _before = ()


def show_thorough(found: tuple[Finding, ...]) -> None:
    """Show the lines of a whole export instead; call `check_now` before."""
    global findings, is_thorough, mended, _before
    findings, is_thorough = found, True
    mended = _before = ()


def check_mended(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Make the quick check after a button has mended something; its line stays in place, so that no other moves."""
    global mended, _before
    before = rows()
    check_now(scene, view_layer)
    said = {finding.sentence for finding in findings}
    mended = tuple(finding for finding in before if finding.fixes and finding.sentence not in said)
    _before = before


def refusal(context: bpy.types.Context, *, of_all: bool = False) -> str:
    """Why a fit would not start, as far as a check since the last change knows; empty where nothing is known.

    With `of_all` of what stops the fit of any object.
    """
    is_known = _checked and _seen == look(context.scene, context.view_layer)
    return first_refused(_quick, of_all=of_all) if is_known else ""


def lists(sentence: str) -> bool:
    """Whether it is among what the panel lists."""
    return any(finding.sentence == sentence for finding in findings)


def rows() -> tuple[Finding, ...]:
    """The lines in the order the panel has them: what was mended where it stood, anything new at the end."""
    kept = [finding for finding in _before if finding in mended or finding in findings]
    return (*kept, *(finding for finding in findings if finding not in kept))


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
    if count(TO_CHOOSE) and not stops:
        return "Choose a picture", "INFO"
    if stops:
        return f"{stops} problem{'s' * (stops > 1)} to fix", "ERROR"
    return ("Ready", "CHECKMARK") if not ignored else (f"Ready, {ignored} note{'s' * (ignored > 1)}", "CHECKMARK")


def reset() -> None:
    """Forget everything and stop the timer."""
    global findings, is_thorough, mended, _before, _quick, _seen, _checked, _files, _files_looked
    findings, is_thorough, mended, _before, _quick, _seen, _checked = (), False, (), (), (), None, False
    _files, _files_looked = None, -math.inf
    for timer in (_run, look_at_files):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


def _run() -> None:
    context = bpy.context
    if context.scene is None or context.view_layer is None:
        return
    before = findings
    check_now(context.scene, context.view_layer)
    if findings != before:
        redraw()


def redraw() -> None:
    """Have every place drawn again that shows the panels, and no view of the scene, which may take long."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) in _WITH_PANELS:
                    region.tag_redraw()


def look(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Any:
    """What can change without the depsgraph saying so, cheap enough for every draw."""
    settings, target = scene.mfo, view_layer.objects.active
    return (
        (scene.name, look_at_scene(scene)),
        target and (target.name, target.active_material_index, getattr(target.active_material, "name", "")),
        [
            (one.use, one.slot, getattr(one.object, "name", ""), getattr(one.material, "name", ""))
            for one in settings.targets
        ],
        (settings.reference_source, settings.reference_path, getattr(settings.reference_image, "name", "")),
        (settings.reference_view, settings.animated, settings.parameter_set, settings.model),
        frozenset(settings.sockets),
        [(bound.name, bound.lower, bound.upper) for bound in settings.bounds],
        [
            (one.use, one.path, one.frame, getattr(one.camera, "name", ""), getattr(one.scene, "name", ""))
            for one in settings.pictures
        ],
        [
            (one.part.crop, getattr(one.part.mask, "name", ""), one.part.use_alpha)
            for one in (settings.first_picture, *settings.pictures)
        ],
    )


def look_at_scene(scene: bpy.types.Scene) -> Any:
    """The same of what an export reads, without what is chosen for the next fit."""
    render, view = scene.render, scene.view_settings
    return (
        scene.camera and scene.camera.name,
        (render.resolution_x, render.resolution_y, render.resolution_percentage, render.engine),
        (render.use_border, render.use_crop_to_border, render.border_min_x, render.border_max_x),
        (render.border_min_y, render.border_max_y, render.pixel_aspect_x, render.pixel_aspect_y),
        (render.image_settings.color_management, render.image_settings.file_format),
        (render.use_multiview, view.view_transform, view.look, view.use_curve_mapping),
        scene.display_settings.display_device,
    )
