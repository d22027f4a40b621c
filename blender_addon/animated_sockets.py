# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets with keyframes or a driver, which give them another value as soon as the frame changes."""

from __future__ import annotations

import bpy

from .versions import curves_of

KEYFRAMES, DRIVER = "keyframes", "a driver"
# what an apply does with them: nothing, or a key at the current frame and no driver any more
LEAVE, REPLACE = "leave", "replace"


def animation_of(node: bpy.types.Node) -> dict[str, str]:
    """What animates the sockets of a node, `KEYFRAMES` or `DRIVER`, by socket name; sockets without are not in it."""
    tree = node.id_data
    if tree.animation_data is None:
        return {}
    driven = {curve.data_path for curve in tree.animation_data.drivers}
    keyed = {curve.data_path for curve in curves_of(tree)}
    found = {}
    for socket in node.inputs:
        if hasattr(socket, "default_value") and not socket.is_linked:
            path = socket.path_from_id("default_value")
            if path in driven or path in keyed:
                found[socket.name] = DRIVER if path in driven else KEYFRAMES
    return found


def animation_notes(node: bpy.types.Node, frame: int) -> tuple[str, ...]:
    """What is said before a fit: one sentence for each animated socket."""
    return tuple(
        f"{name} has {what} and is fitted as it is at frame {frame}. An applied value would be lost when the frame "
        f"changes, so it is left out, unless {_remedy(what)} (Animated: Replace, --animated replace)."
        for name, what in animation_of(node).items()
    )


def left_note(name: str, what: str) -> str:
    """The sentence for a socket that an apply has left out."""
    return (
        f"{name} has {what} and was left as it is: apply again so that {_remedy(what)} (Animated: Replace, --animated "
        "replace)."
    )


def remove_driver(socket: bpy.types.NodeSocket) -> None:
    """Take the driver or drivers of a socket away; it keeps the value it has."""
    socket.driver_remove("default_value")


def key_here(socket: bpy.types.NodeSocket) -> bool:
    """Put a key with the socket's value at the current frame; False where its action cannot be changed."""
    try:
        return bool(socket.keyframe_insert("default_value"))
    except (RuntimeError, TypeError):
        return False


def _remedy(what: str) -> str:
    return "the driver is removed" if what == DRIVER else "a key is put at the current frame"
