# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures of files that the panels name; loaded by a timer after they were asked for, never while drawing."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from pathlib import Path

import bpy

from ..check.preflight import redraw
from ..pictures import previews

BETWEEN = 0.05  # seconds from one to the next, in which Blender draws: its own loader takes 0.14 for 1920 x 1080
LASTS = 2.0  # seconds after which a file that is drawn is looked at again: it may be on a drive that answers slowly
_asked: dict[Path, None] = {}
_names: dict[Path, str] = {}  # of the icon of each file, empty where there is none
_refused: set[str] = set()
_looked: dict[Path, float] = {}  # when each was looked at, on the monotonic clock


def thumbnail(path: Path) -> int:
    """Icon number of the picture in a file as it was some seconds ago; 0 until it is loaded, where there is none."""
    if not bpy.app.background and time.monotonic() - _looked.get(path, -math.inf) > LASTS:
        _asked[path] = None
        if not bpy.app.timers.is_registered(_load):
            bpy.app.timers.register(_load, first_interval=BETWEEN)
    return previews.icon(_names.get(path, ""))


def close() -> None:
    """Stop the timer and forget what was asked for."""
    for known in (_asked, _names, _refused, _looked):
        known.clear()
    if bpy.app.timers.is_registered(_load):
        bpy.app.timers.unregister(_load)


def _load() -> float | None:
    if not _asked:
        return None
    path, _ = _asked.popitem()
    _looked[path] = time.monotonic()
    before, name = previews.icon(_names.get(path, "")), _name_of(path)
    _names[path] = name
    if name and not previews.icon(name) and name not in _refused:  # icons go when another fit begins
        _refused.add(name)  # what cannot be read is asked for once
        with suppress(OSError):
            previews.show_file(name, path)
            _refused.discard(name)
    if previews.icon(name) != before:
        redraw()
    return BETWEEN if _asked else None


def _name_of(path: Path) -> str:
    """Another one for each state of a file; empty where there is none."""
    try:
        return f"{path} {path.stat().st_mtime_ns}"
    except OSError:
        return ""
