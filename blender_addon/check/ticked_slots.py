# SPDX-License-Identifier: GPL-3.0-or-later
"""Which materials the next fit is of, where several are listed."""

from __future__ import annotations

import bpy

from ..export.fitted_slot import FittedSlot

NONE_TICKED = "No material of the list is ticked: tick those that are to be fitted, or fit one material."


def ticked_slots(scene: bpy.types.Scene) -> list[FittedSlot]:
    """The slots of the list that are to be fitted together, as far as they are still there."""
    found = (slot_of(scene, entry) for entry in scene.mfo.targets if entry.use)
    return [each for each in found if each is not None]


def slot_of(scene: bpy.types.Scene, entry: bpy.types.PropertyGroup) -> FittedSlot | None:
    """Where an entry's material is; None where its object is not in the scene or does not have it any more."""
    obj = entry.object
    if obj is None or scene.objects.get(obj.name) is not obj:
        return None
    slots = [n for n, slot in enumerate(obj.material_slots) if slot.material is not None]
    same = [n for n in slots if obj.material_slots[n].material == entry.material]
    # the material may have moved to another slot since
    slot = entry.slot if entry.slot in same else next(iter(same), None)
    return None if slot is None else FittedSlot(obj, slot)


def left_out(scene: bpy.types.Scene) -> list[str]:
    """A sentence for each ticked entry that is not there any more."""
    found = []
    for entry in scene.mfo.targets:
        if not entry.use or slot_of(scene, entry) is not None:
            continue
        obj, material = entry.object, entry.material
        if material is None:
            found.append("A material of the list is left out: it is not in the file any more. List the materials anew.")
        elif obj is None or scene.objects.get(obj.name) is not obj:
            found.append(
                f"Material '{material.name}' is left out: its object is not in the scene any more. List the materials "
                "anew."
            )
        else:
            found.append(
                f"Material '{material.name}' is left out: '{obj.name}' does not have it any more. List the materials "
                "anew."
            )
    return list(dict.fromkeys(found))
