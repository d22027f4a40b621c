# SPDX-License-Identifier: GPL-3.0-or-later
"""The state of the backend as preferences and panel draw it. Reads what `backend_state` knows, touches nothing."""

from __future__ import annotations

import bpy

from ..sentences.translated import translated
from ..text_width import shortened, wrapped
from . import backend_state
from .backend_install import SIZE
from .preferences import preference

_ICONS = {"UNKNOWN": "QUESTION", "NOT_INSTALLED": "IMPORT", "TESTING": "TIME", "READY": "CHECKMARK", "BROKEN": "ERROR"}
_TITLES = {
    "UNKNOWN": "Backend: not tested",
    "NOT_INSTALLED": "Backend: not installed",
    "INSTALLING": "Backend: installing",
    "TESTING": "Backend: being tested",
    "READY": "Backend: ready",
    "BROKEN": "Backend: broken",
}


def why_no_fit() -> str:
    """Why the backend cannot run a fit as it is now, empty where it can or nobody has asked it yet."""
    if backend_state.current.name == "BROKEN":
        return "The backend cannot run: the box below says why, and what helps"
    return "The backend is not installed yet: press Install below" if has_trouble() else ""


def has_trouble() -> bool:
    """Whether a panel should show what is wrong with the backend."""
    return backend_state.current.name in {"NOT_INSTALLED", "INSTALLING", "BROKEN"}


def draw_setup(layout: bpy.types.UILayout, context: bpy.types.Context, *, width: float) -> None:
    """Draw state, reasons, log and buttons; `width` of a line, in pixels at a scale of 1."""
    state = backend_state.current
    box = layout.box()
    box.alert = state.name == "BROKEN"
    box.label(text=_TITLES[state.name], icon=_ICONS.get(state.name, "IMPORT"))
    box.alert = False
    if state.name == "INSTALLING":
        row = box.row(align=True)
        row.progress(factor=state.fraction, type="BAR", text=translated(state.step))
        row.operator("mfo.cancel_install", text="", icon="X")
        _lines(box, context, state.log, width)
        return
    if state.name == "NOT_INSTALLED":
        text = "Fits run beside Blender, in a Python environment of their own. Blender's Python stays as it is."
        _wrapped(box, context, text, width)
        _wrapped(box, context, SIZE[:1].upper() + SIZE[1:] + ".", width)
    else:
        _wrapped(box, context, state.sentence, width)
    for problem in state.problems:
        _wrapped(box, context, problem, width)
    if state.name != "READY":
        _draw_network(box, context, width)
        row = box.row()
        row.scale_y = 1.2
        again = state.has_folder and state.name != "NOT_INSTALLED"  # the folder may hold a log alone
        row.operator("mfo.install_backend", text="Install Again" if again else "Install", icon="IMPORT")
    column = box.column(align=True)
    if state.python:
        column.operator("mfo.test_backend", text="Test", icon="FILE_REFRESH")
    row = column.row(align=True)
    if state.has_folder:
        row.operator("mfo.remove_backend", text="Remove", icon="TRASH")
    if state.log_file:
        row.operator("mfo.open_install_log", text="", icon="TEXT")


def _draw_network(layout: bpy.types.UILayout, context: bpy.types.Context, width: float) -> None:
    """Blender's own switch, where an installation would need it."""
    if bpy.app.online_access or bpy.app.online_access_override or preference(bpy.context, "wheels"):
        return
    _wrapped(layout, context, "Install downloads packages, for which Blender needs your leave.", width)
    layout.prop(bpy.context.preferences.system, "use_online_access", text="Allow Online Access")


def _wrapped(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, width: float) -> None:
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in wrapped(context, translated(text), width):
        column.label(text=line, translate=False)


def _lines(layout: bpy.types.UILayout, context: bpy.types.Context, lines: list[str], width: float) -> None:
    column = layout.column(align=True)
    column.scale_y = 0.7
    column.enabled = False
    for line in lines:
        column.label(text=shortened(context, line, width), translate=False)
