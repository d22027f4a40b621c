# SPDX-License-Identifier: GPL-3.0-or-later
"""What must happen when Blender opens another file, when something changes, and after an undo."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..check import preflight
from ..pictures import comparison
from . import cycles_check, running_export, running_job


@persistent
def _before_load(*_args: object) -> None:
    running_export.close()
    running_job.close()  # the objects and materials it works on go away
    cycles_check.close()
    preflight.reset()


@persistent
def _after_load(*_args: object) -> None:
    comparison.forget()
    running_job.reset()  # the window manager comes out of the file, with the state of another day


@persistent
def _before_undo(*_args: object) -> None:
    running_export.undone()


@persistent
def _after_change(*_args: object) -> None:
    preflight.request()


_HANDLERS = {
    "load_pre": _before_load,
    "load_post": _after_load,
    "depsgraph_update_post": _after_change,
    "undo_pre": _before_undo,
    "redo_pre": _before_undo,
    "undo_post": _after_change,
    "redo_post": _after_change,
}


def register() -> None:
    """Watch for files being opened and for changes."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop watching."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
