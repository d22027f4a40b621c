# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets with keyframes or a driver, which give them another value as soon as the frame changes."""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from ..versions import curves_of

KEYFRAMES, DRIVER = "keyframes", "a driver"
# what an apply does with them: nothing, or a key at the current frame and no driver any more
LEAVE, REPLACE = "leave", "replace"


def animation_of(sockets: Mapping[str, bpy.types.NodeSocket]) -> dict[str, str]:
    """What animates sockets, `KEYFRAMES` or `DRIVER`, by their names; those without are not in it."""
    found, trees = {}, {}
    for name, socket in sockets.items():
        tree = socket.id_data
        if tree.animation_data is None or not hasattr(socket, "default_value") or socket.is_linked:
            continue
        if tree not in trees:
            trees[tree] = ({c.data_path for c in tree.animation_data.drivers}, {c.data_path for c in curves_of(tree)})
        (driven, keyed), path = trees[tree], socket.path_from_id("default_value")
        if path in driven or path in keyed:
            found[name] = DRIVER if path in driven else KEYFRAMES
    return found


def animation_notes(sockets: Mapping[str, bpy.types.NodeSocket], frame: int) -> tuple[str, ...]:
    """What is said before a fit: one sentence for each animated socket."""
    return tuple(
        f"{name} has {what} and is fitted as it is at frame {frame}. An applied value would be lost when the frame "
        f"changes, so it is left out, unless {_remedy(what)} (Animated: Replace, --animated replace)."
        for name, what in animation_of(sockets).items()
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
