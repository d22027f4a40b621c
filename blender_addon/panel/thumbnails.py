# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures of files that the panels name; loaded by a timer after they were asked for, never while drawing."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import bpy

from ..check.preflight import redraw
from ..pictures import previews

BETWEEN = 0.05  # seconds from one to the next, in which Blender draws: its own loader takes 0.14 for 1920 x 1080
_asked: dict[str, Path] = {}
_refused: set[str] = set()


def thumbnail(path: Path) -> int:
    """Icon number of the picture in a file, as it is now; 0 until it is loaded, and where there is none."""
    try:
        name = f"{path} {path.stat().st_mtime_ns}"
    except OSError:
        return 0
    found = previews.icon(name)
    if not found and name not in _refused and not bpy.app.background:
        _asked[name] = path
        if not bpy.app.timers.is_registered(_load):
            bpy.app.timers.register(_load, first_interval=BETWEEN)
    return found


def close() -> None:
    """Stop the timer and forget what was asked for."""
    _asked.clear()
    _refused.clear()
    if bpy.app.timers.is_registered(_load):
        bpy.app.timers.unregister(_load)


def _load() -> float | None:
    if not _asked:
        return None
    name, path = _asked.popitem()
    _refused.add(name)  # unless it is there by its name from now on; it is asked for once
    with suppress(OSError):
        previews.show_file(name, path)
        _refused.discard(name)
    redraw()
    return BETWEEN if _asked else None
