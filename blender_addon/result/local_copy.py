# SPDX-License-Identifier: GPL-3.0-or-later
"""An object from a library with its mesh and material as parts of this file, so that values can be applied."""

from __future__ import annotations

from typing import Any

import bpy


class LocalCopyError(Exception):
    """Something stays in its library; the message is one sentence for the user."""


def unwritable(material: bpy.types.Material | None) -> str:
    """Why Blender does not keep values of this material's nodes, as a sentence; empty where it does."""
    cure = "make it local first (Make Local, --make-local)."
    if material is None:
        return ""
    if material.library is not None or not material.is_editable:
        return f"Material {material.name!r} comes from a library: {cure}"
    if material.override_library is not None:
        return f"Material {material.name!r} is a library override, in which Blender keeps no values of nodes: {cure}"
    return ""


def make_local(obj: bpy.types.Object, slot: int) -> bpy.types.Material:
    """Make the object, its mesh and the material in a slot of it parts of this file; returns the material.

    Raises
    ------
    LocalCopyError
        If the object has no material, or one of the three stays in its library.
    """
    obj = _local(obj)
    if obj.data is not None:
        _local(obj.data)
    material = obj.material_slots[slot].material if slot < len(obj.material_slots) else None
    if material is None:
        raise LocalCopyError(f"Object '{obj.name}' has no material in its slot {slot + 1}.")
    return _local(material)


def _local(item: Any) -> Any:
    if item.library is None and item.override_library is None:
        return item
    name = item.name
    found = item.make_local(clear_liboverride=True)
    if found is None or found.library is not None or found.override_library is not None:
        kind = item.bl_rna.name.lower()
        raise LocalCopyError(
            f"The {kind} '{name}' stays in its library, because only a linked collection holds it: make that "
            "collection local first (Object > Relations > Make Local)."
        )
    return found
