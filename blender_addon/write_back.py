# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovered values onto a Principled node and the original ones back; links and node graph stay as they are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np

from .export.principled_mapping import mitsuba_to_sockets
from .export.shader_graph import surface_of
from .job_result import JobResult, Value
from .versions import PRINCIPLED, node_tree_of, working_space_to_rec709


class WriteBackError(Exception):
    """The values cannot be applied; the message is one sentence for the user."""


def principled_node(material: bpy.types.Material) -> bpy.types.ShaderNode:
    """The Principled node that the Cycles output of `material` shows.

    Raises
    ------
    WriteBackError
        If there is none.
    """
    node = surface_of(node_tree_of(material))
    if node is not None and node.bl_idname == PRINCIPLED:
        return node
    raise WriteBackError(
        f"Material {material.name!r} has no Principled BSDF on its output: connect one and apply again."
    )


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


def apply_values(material: bpy.types.Material, values: Mapping[str, Value], folder: Path) -> list[str]:
    """Set the unlinked sockets in `values` (linear Rec.709), keep what they were, return what was skipped and why.

    Nothing is set before all of it is known to fit. A second call keeps the originals of the first one, so that
    `revert_values` always leads to the user's own material.

    Raises
    ------
    WriteBackError
        If the material is read-only, has no Principled node, or a value is none that its socket can hold.
    """
    if not material.is_editable:
        raise WriteBackError(f"Material {material.name!r} comes from a library: make it local first.")
    node = principled_node(material)
    notes, changes = [], []
    for name, value in values.items():
        socket = node.inputs.get(name)
        if socket is None:
            notes.append(f"{name} does not exist in this Blender version and was skipped.")
        elif socket.is_linked:
            notes.append(f"{name} has a link and was left as it is.")
        else:
            changes.append((socket, _fitting(socket, value)))
    for socket, value in changes:
        _keep_original(material.mfo, socket)
        socket.default_value = value
    material.mfo.job_folder = str(folder)
    return notes


def revert_values(material: bpy.types.Material) -> list[str]:
    """Give the sockets the values they had before the first `apply_values`; returns what could not be set."""
    node = principled_node(material)
    notes = []
    for original in material.mfo.originals:
        socket = node.inputs.get(original.name)
        if socket is None:
            notes.append(f"{original.name} does not exist any more and was skipped.")
        elif original.size != len(_numbers(socket)):  # it became another kind of socket, or the file was tampered with
            notes.append(f"{original.name} was kept as {original.size} numbers and could not be set.")
        elif original.size == 1:
            socket.default_value = original.value[0]
        else:
            socket.default_value = original.value[: original.size]
    material.mfo.originals.clear()
    material.mfo.job_folder = ""
    return notes


def _keep_original(kept: bpy.types.PropertyGroup, socket: bpy.types.NodeSocket) -> None:
    if socket.name in kept.originals:
        return
    numbers = _numbers(socket)
    original = kept.originals.add()
    original.name, original.size = socket.name, len(numbers)
    original.value = (*numbers, 0.0, 0.0, 0.0)[:4]


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
