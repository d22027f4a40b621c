# SPDX-License-Identifier: GPL-3.0-or-later
"""What must happen when Blender opens or saves a file, when something changes, and after an undo."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..check import preflight
from ..pictures import comparison, overlay
from . import cycles_check, kept_results, notice, running_export, running_job

_ended = ""  # what is to be said of the file that is left


@persistent
def _before_load(*_args: object) -> None:
    global _ended
    running_export.close()
    _ended = running_job.close_for_load()  # the objects and materials it works on go away
    cycles_check.close()
    preflight.reset()


@persistent
def _after_load(*_args: object) -> None:
    global _ended
    comparison.forget()
    overlay.forget()
    said = [_ended] if _ended else []
    _ended = ""
    if not bpy.app.background:  # a script gets the file as it is
        said += kept_results.restore()
    running_job.reset(" ".join(said))  # the window manager comes out of the file, with the state of another day
    if said:
        notice.show(" ".join(said))


@persistent
def _before_save(*_args: object) -> None:
    overlay.keep()


@persistent
def _after_save(*args: object) -> None:
    # a copy of the file, as an export writes it, is not the file
    if not bpy.app.background and args and args[0] == bpy.data.filepath:
        kept_results.saved(running_job.folders())


@persistent
def _before_undo(*_args: object) -> None:
    running_export.undone()


@persistent
def _after_undo(*_args: object) -> None:
    overlay.repaint(bpy.context.scene)
    preflight.request()


@persistent
def _after_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    running_export.changed(depsgraph)
    preflight.request()


_HANDLERS = {
    "load_pre": _before_load,
    "load_post": _after_load,
    "save_pre": _before_save,
    "save_post": _after_save,
    "depsgraph_update_post": _after_update,
    "undo_pre": _before_undo,
    "redo_pre": _before_undo,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
}


def register() -> None:
    """Watch for files being opened and for changes."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop watching."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
