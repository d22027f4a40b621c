# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovered values onto a Principled node and the original ones back; links and node graph stay as they are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..export.materials.principled_mapping import mitsuba_to_sockets
from ..export.nodes.target_shader import TargetShader, make_own, target_shader
from ..versions import working_space_to_rec709
from .animated_sockets import DRIVER, KEYFRAMES, LEAVE, REPLACE, animation_of, key_here, left_note, remove_driver
from .job_result import JobResult, Value
from .local_copy import unwritable


class WriteBackError(Exception):
    """The values cannot be applied; the message is one sentence for the user."""


def fitted_shader(material: bpy.types.Material) -> TargetShader:
    """The Principled or Diffuse node that the Cycles output of `material` shows.

    Raises
    ------
    WriteBackError
        If there is none.
    """
    target = target_shader(material)
    if target is None:
        raise WriteBackError(
            f"Material {material.name!r} has no Principled BSDF on its output: connect one and apply again."
        )
    return target


def result_to_sockets(result: JobResult) -> dict[str, Value]:
    """Blender's socket names and linear Rec.709 values of a result.

    Raises
    ------
    WriteBackError
        If the fitted model is unknown.
    """
    if result.model == "mitsuba_principled":
        return dict(mitsuba_to_sockets(result.recovered, result.sockets_start))
    if result.model == "blender_principled":
        names = {socket_to_parameter(name): name for name in result.sockets_start}
        unknown = [name for name in result.recovered if name not in names]
        if unknown:
            raise WriteBackError(
                f"The result holds {', '.join(unknown)}, which no socket of its material is named after."
            )
        return {names[name]: value for name, value in result.recovered.items()}
    raise WriteBackError(f"The result is of the model {result.model!r}, which this add-on cannot apply; update it.")


def socket_to_parameter(socket_name: str) -> str:
    """The parameter name of a socket: ``Coat Roughness`` is ``coat_roughness``."""
    return socket_name.lower().replace(" ", "_")


def apply_values(
    material: bpy.types.Material, values: Mapping[str, Value], folder: Path, *, animated: str = LEAVE
) -> list[str]:
    """Set the unlinked sockets in `values` (linear Rec.709), keep what they were, return what was skipped and why.

    Nothing is set before all of it is known to fit. A second call keeps the originals of the first one, so that
    `revert_values` always leads to the user's own material. Sockets with keyframes or a driver stay as they are, or
    with `REPLACE` get a key at the current frame and lose the driver, which `revert_values` does not bring back.

    Raises
    ------
    WriteBackError
        If the material is read-only, has no shader that is fitted, or a value is none that its socket can hold.
    """
    if unwritable(material):
        raise WriteBackError(unwritable(material))
    target, kept = fitted_shader(material), material.mfo
    notes, changes, moved = [], {}, animation_of(target.sockets)
    for name, value in values.items():
        socket = target.sockets.get(name)
        if socket is None:
            notes.append(f"{name} does not exist in this Blender version and was skipped.")
        elif socket.is_linked:
            notes.append(f"{target.own_name(name)} has a link and was left as it is.")
        elif name in moved and animated != REPLACE:
            notes.append(left_note(target.own_name(name), moved[name]))
        else:
            changes[name] = _fitting(socket, value)
    if kept.shows_original:
        toggle_values(material)  # so that what is kept as the original stays apart from what was applied
    notes += make_own(material, changes)
    sockets = fitted_shader(material).sockets
    for name, value in changes.items():
        socket = sockets[name]
        if name not in kept.originals:
            keep_value(kept.originals, name, socket.default_value)
        if moved.get(name) == DRIVER:
            remove_driver(socket)
            notes.append(f"The driver of {socket.name} was removed.")
        _set(socket, value, moved.get(name))
        if moved.get(name) == KEYFRAMES:
            notes.append(f"{socket.name} got a key at the current frame; its other keys stay.")
        keep_value(kept.applied, name, socket.default_value)
    kept.job_folder = str(folder)
    return notes


def toggle_values(material: bpy.types.Material) -> list[str]:
    """Give the sockets the other of what they were before and what was applied; what a user changed since is kept.

    Returns what could not be set.
    """
    kept, sockets = material.mfo, fitted_shader(material).sockets
    left, entered = (kept.originals, kept.applied) if kept.shows_original else (kept.applied, kept.originals)
    for value in left:
        socket = sockets.get(value.name)
        if socket is not None and value.size == len(_numbers(socket)):
            keep_value(left, value.name, socket.default_value)
    kept.shows_original = not kept.shows_original
    return _restore(material, entered)


def revert_values(material: bpy.types.Material) -> list[str]:
    """Give the sockets the values they had before the first `apply_values`; returns what could not be set."""
    kept = material.mfo
    notes = [] if kept.shows_original else _restore(material, kept.originals)
    kept.originals.clear()
    kept.applied.clear()
    kept.job_folder, kept.shows_original = "", False
    return notes


def keep_value(values: bpy.types.bpy_prop_collection, name: str, value: Any) -> bpy.types.PropertyGroup:
    """Put the numbers of a socket (or of a result) into the entry of that name, made if there is none."""
    numbers = (value,) if isinstance(value, (int, float)) else tuple(value)
    entry = values.get(name) or values.add()
    entry.name, entry.size = name, len(numbers)
    entry.value = (*numbers, 0.0, 0.0, 0.0)[:4]
    return entry


def kept_value(entry: bpy.types.PropertyGroup) -> Value:
    """The number or numbers of an entry."""
    return entry.value[0] if entry.size == 1 else tuple(entry.value[: entry.size])


def _restore(material: bpy.types.Material, values: bpy.types.bpy_prop_collection) -> list[str]:
    fitted_shader(material)
    notes = make_own(material, [entry.name for entry in values])  # shared again, by a copy of the material
    sockets = fitted_shader(material).sockets
    moved = animation_of(sockets)
    for entry in values:
        socket = sockets.get(entry.name)
        if socket is None:
            notes.append(f"{entry.name} does not exist any more and was skipped.")
        elif entry.size != len(_numbers(socket)):  # it became another kind of socket, or the file was tampered with
            notes.append(f"{entry.name} was kept as {entry.size} numbers and could not be set.")
        else:
            _set(socket, kept_value(entry), moved.get(entry.name))
    return notes


def _set(socket: bpy.types.NodeSocket, value: Value, animation: str | None) -> None:
    """Set a socket's value and, where it has keyframes, put a key, without which the next frame takes it away."""
    socket.default_value = value
    if animation == KEYFRAMES and not key_here(socket):
        raise WriteBackError(f"No key can be put for {socket.name}: its action cannot be changed, make it local first.")


def _numbers(socket: bpy.types.NodeSocket) -> tuple[float, ...]:
    value = getattr(socket, "default_value", ())  # a shader socket has none
    return (value,) if isinstance(value, (int, float)) else tuple(value)


def _fitting(socket: bpy.types.NodeSocket, value: Value) -> Value:
    """The value as the socket takes it: a number, or as many as it has."""
    held = _numbers(socket)
    given = value if isinstance(value, tuple) else (value,)
    is_color = socket.type == "RGBA"
    if len(given) not in ((3, 4) if is_color else (len(held),)):
        raise WriteBackError(
            f"The result has {len(given)} numbers for {socket.name}, which holds {len(held)}: run the fit again."
        )
    if not is_color:
        return given if len(held) > 1 else given[0]
    matrix = working_space_to_rec709()
    color = np.array(given[:3]) if matrix is None else np.linalg.solve(matrix, given[:3])
    return (*map(float, color), held[3])
