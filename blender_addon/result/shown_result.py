# SPDX-License-Identifier: GPL-3.0-or-later
"""The one result the panel shows and `mfo.apply` takes: of the last fit, of a history, or of a job folder."""

from __future__ import annotations

import bpy

from ..pictures import previews
from .job_result import JobResult, Value
from .write_back import result_to_sockets, socket_to_parameter

CHECKED = ("cycles", "cycles_difference", "engine", "engine_difference")  # by the check in Cycles
# "current" is there where the backend was killed before it wrote the others
PICTURES = ("reference", "start", "result", "difference", "current", "curve", *CHECKED)
_ERROR_LABELS = {"flip": "FLIP", "hdr_flip": "HDR-FLIP"}  # others are for the report
VERDICT_ICONS = {"same": "CHECKMARK", "close": "QUESTION", "different": "ERROR"}  # others have no verdict
_KEPT = ("split", "shows_difference")  # settings of the view, not of a fit

result: JobResult | None = None
material_uid = 0  # session_uid of its material, 0 when it came from another session
together: list[tuple[JobResult, int]] = []  # results of materials fitted together, with their uids; `result` is one


def show(found: JobResult, uid: int) -> None:
    """Make `found` the result; `uid` is its material's session_uid or 0.

    Raises
    ------
    WriteBackError
        If the fitted model is unknown.
    """
    global result, material_uid
    sockets = result_to_sockets(found)
    result, material_uid = found, uid
    runtime = bpy.context.window_manager.mfo_runtime
    runtime.verdict = found.verdict
    runtime.has_result, runtime.job_folder, runtime.material = True, str(found.folder), found.material_name
    for name, (before, after) in found.errors.items():
        if name in _ERROR_LABELS:
            _add_row(runtime.errors, _ERROR_LABELS[name], before, after)
    for name, value in sockets.items():
        label = found.labels.get(socket_to_parameter(name), name)
        _add_row(runtime.values, label, found.sockets_start.get(name, found.initial.get(name)), value)
        _say_how_sure(runtime.values[-1], found, socket_to_parameter(name), value)
    for note in found.notes:
        if note not in runtime.messages:
            add_message(runtime, note, "INFO")
    for name in PICTURES:
        previews.show(name, found.folder / "pictures")


def show_all(found: list[tuple[JobResult, int]]) -> None:
    """Make results of materials fitted together those that are applied, and show the first; errors as of `show`."""
    together[:] = found if len(found) > 1 else []
    show(*found[0])
    _list_together(0)


def show_one(index: int) -> None:
    """Show another one of the results of materials fitted together; errors as of `show`."""
    runtime = bpy.context.window_manager.mfo_runtime
    for rows in (runtime.values, runtime.errors, runtime.messages):
        rows.clear()
    previews.clear()
    runtime.sentence = together[index][0].sentence
    show(*together[index])
    _list_together(index)


def _list_together(shown: int) -> None:
    runtime = bpy.context.window_manager.mfo_runtime
    runtime.materials.clear()
    runtime.shown_material = shown
    for each, _uid in together:
        row = runtime.materials.add()
        row.name, row.words = each.material_name, each.verdict
        row.start, row.result = (_shown(error) for error in each.errors.get("flip", (0.0, 0.0)))


def clear(runtime: bpy.types.PropertyGroup) -> None:
    """Show no result, no messages and no pictures."""
    global result, material_uid
    result, material_uid = None, 0
    together.clear()
    previews.clear()
    for prop in runtime.bl_rna.properties:
        if prop.type == "COLLECTION":
            getattr(runtime, prop.identifier).clear()
        elif not prop.is_readonly and prop.identifier not in _KEPT:
            runtime.property_unset(prop.identifier)


def material() -> bpy.types.Material | None:
    """The material of the result under whatever name it has by now, if it was fitted since Blender started."""
    return material_of(material_uid)


def material_of(uid: int) -> bpy.types.Material | None:
    """The material with this session_uid; None for 0."""
    return next((m for m in bpy.data.materials if m.session_uid == uid), None) if uid else None


def add_message(runtime: bpy.types.PropertyGroup, text: str, icon: str) -> None:
    """Add one line to the panel's notes."""
    message = runtime.messages.add()
    message.name, message.icon = text, icon


def _say_how_sure(row: bpy.types.PropertyGroup, found: JobResult, parameter: str, value: Value) -> None:
    row.certainty = found.certainty.get(parameter, "")
    row.words = found.certainty_words.get(parameter, "")
    if found.model != "blender_principled":
        return  # its parameters have other units than the sockets
    row.sureness = found.sureness(parameter)
    likely = found.likely(parameter, value) if isinstance(value, float) else None
    if likely is not None:
        row.words = f"{row.words}; likely {likely[0]:.3g} to {likely[1]:.3g}".removeprefix("; ")


def _add_row(rows: bpy.types.bpy_prop_collection, label: str, before: Value | None, after: Value) -> None:
    row = rows.add()
    row.name = label
    row.start, row.result = _shown(before), _shown(after)


def _shown(value: Value | None) -> str:
    if value is None:
        return ""
    return previews.swatch(value) if isinstance(value, tuple) else f"{value:.3g}"
