# SPDX-License-Identifier: GPL-3.0-or-later
"""The results a material had, kept on it and so in the .blend: enough to apply each without its job folder."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path

import bpy

from .job_result import JobResult, Value
from .write_back import keep_value, kept_value, result_to_sockets, socket_to_parameter

LIMIT = 20  # results of one material; the oldest goes, but never the one that is applied


def record(material: bpy.types.Material, result: JobResult) -> bpy.types.PropertyGroup:
    """Add a result to the history of its material, newest first; a job that is there already is replaced.

    Raises
    ------
    WriteBackError
        If the fitted model is unknown.
    """
    values = result_to_sockets(result)
    history = material.mfo.history
    _forget(history, str(result.folder))
    entry = history.add()
    entry.name = _time_of(result.folder)
    entry.job_folder, entry.preset, entry.partial = str(result.folder), _preset_of(result.folder), result.partial
    entry.verdict, entry.leaf = result.verdict, result.leaf
    entry.flip_before, entry.flip = result.errors.get("flip", (-1.0, -1.0))
    for name, value in values.items():
        keep_value(entry.values, name, value).certainty = result.certainty.get(socket_to_parameter(name), "")
    history.move(len(history) - 1, 0)
    material.mfo.history_index = 0
    for i in range(len(history) - 1, 0, -1):
        if len(history) > LIMIT and history[i].job_folder != material.mfo.job_folder:
            history.remove(i)
    return history[0]


def values_of(entry: bpy.types.PropertyGroup) -> dict[str, Value]:
    """Socket names and linear Rec.709 values of a result in a history."""
    return {value.name: kept_value(value) for value in entry.values}


def chosen(material: bpy.types.Material | None) -> bpy.types.PropertyGroup | None:
    """The result that is marked in the history of a material, or None."""
    if material is None or not 0 <= material.mfo.history_index < len(material.mfo.history):
        return None
    return material.mfo.history[material.mfo.history_index]


def _forget(history: bpy.types.bpy_prop_collection, job_folder: str) -> None:
    for i in reversed(range(len(history))):
        if history[i].job_folder == job_folder:
            history.remove(i)


def _time_of(folder: Path) -> str:
    try:
        moment = datetime.fromtimestamp((folder / "result.json").stat().st_mtime)
    except OSError:
        moment = datetime.now()
    return f"{moment:%Y-%m-%d %H:%M:%S}"


def _preset_of(folder: Path) -> str:
    try:
        return str(json.loads((folder / "request.json").read_text("utf-8"))["fit"].get("preset", ""))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return ""
