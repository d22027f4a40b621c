# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets with keyframes or a driver, which give them another value as soon as the frame changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy

from ..versions import curves_of

KEYFRAMES, DRIVER = "keyframes", "a driver"
# what an apply does with them: nothing, or a key at the current frame and no driver any more
LEAVE, REPLACE = "leave", "replace"


# what holds a value, a socket or a part of a node, and the name of the attribute
Holder = tuple[Any, str]
VALUE = "default_value"  # of a socket


def animation_of(sockets: Mapping[str, bpy.types.NodeSocket]) -> dict[str, str]:
    """What animates unlinked sockets, `KEYFRAMES` or `DRIVER`, by their names; those without are not in it."""
    return animation_at({name: (s, VALUE) for name, s in sockets.items() if hasattr(s, VALUE) and not s.is_linked})


def animation_at(holders: Mapping[str, Holder]) -> dict[str, str]:
    """What animates values, `KEYFRAMES` or `DRIVER`, by their names; those without are not in it."""
    found, trees = {}, {}
    for name, (owner, attribute) in holders.items():
        tree = owner.id_data
        if tree is None or tree.animation_data is None:
            continue
        if tree not in trees:
            trees[tree] = ({c.data_path for c in tree.animation_data.drivers}, {c.data_path for c in curves_of(tree)})
        try:
            (driven, keyed), path = trees[tree], owner.path_from_id(attribute)
        except ValueError:  # it has no path, and so no animation
            continue
        if path in driven or path in keyed:
            found[name] = DRIVER if path in driven else KEYFRAMES
    return found


def animation_notes(holders: Mapping[str, Holder], frame: int) -> tuple[str, ...]:
    """What is said before a fit: one sentence for each animated value."""
    return tuple(
        f"{name} has {what} and is fitted as it is at frame {frame}. An applied value would be lost when the frame "
        f"changes, so it is left out, unless {_remedy(what)} (Animated: Replace, --animated replace)."
        for name, what in animation_at(holders).items()
    )


def left_note(name: str, what: str) -> str:
    """The sentence for a socket that an apply has left out."""
    return (
        f"{name} has {what} and was left as it is: apply again so that {_remedy(what)} (Animated: Replace, --animated "
        "replace)."
    )


def remove_driver(owner: Any, attribute: str = VALUE) -> None:
    """Take the driver or drivers of a value away; it stays what it is."""
    owner.driver_remove(attribute)


def key_here(owner: Any, attribute: str = VALUE) -> bool:
    """Put a key with the value at the current frame; False where its action cannot be changed."""
    try:
        return bool(owner.keyframe_insert(attribute))
    except (RuntimeError, TypeError):
        return False


def _remedy(what: str) -> str:
    return "the driver is removed" if what == DRIVER else "a key is put at the current frame"
