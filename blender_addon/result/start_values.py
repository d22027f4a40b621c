# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of another material of the file as the start of a fit: nodes and links stay as they are."""

from __future__ import annotations

import bpy

from ..export.nodes.target_shader import TargetShader, target_shader
from .local_copy import unwritable


class StartError(Exception):
    """The values cannot be taken; the message is one sentence for the user."""


def take_values(material: bpy.types.Material, other: bpy.types.Material) -> list[str]:
    """Set the unlinked sockets of the material's shader to the values of the other's; returns the names of the changed.

    What is linked on either side stays.

    Raises
    ------
    StartError
        If the material cannot be changed, or one of them has no shader that is fitted.
    """
    if unwritable(material):
        raise StartError(unwritable(material))
    target, source = _shader(material), _shader(other)
    changed = []
    for name, socket in target.sockets.items():
        given = source.sockets.get(name)
        if given is None or socket.is_linked or given.is_linked or not hasattr(socket, "default_value"):
            continue
        before, after = _held(socket), _held(given)
        if type(before) is type(after) and before != after:
            socket.default_value = given.default_value
            changed.append(target.own_name(name))
    return changed


def _held(socket: bpy.types.NodeSocket) -> object:
    value = socket.default_value
    return tuple(value) if hasattr(value, "__len__") else value


def _shader(material: bpy.types.Material) -> TargetShader:
    found = target_shader(material)
    if found is None:
        raise StartError(f"Material '{material.name}' has no shader whose values are fitted: choose another.")
    return found
