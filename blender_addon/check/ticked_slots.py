# SPDX-License-Identifier: GPL-3.0-or-later
"""Which materials the next fit is of, where several are listed."""

from __future__ import annotations

import bpy

from ..export.fitted_slot import FittedSlot

NONE_TICKED = "No material of the list is ticked: tick those that are to be fitted, or fit one material."


def ticked_slots(scene: bpy.types.Scene) -> list[FittedSlot]:
    """The slots of the list that are to be fitted together, as far as they are still there."""
    found = []
    for entry in scene.mfo.targets:
        obj = entry.object
        if not entry.use or obj is None or scene.objects.get(obj.name) is not obj:
            continue
        slots = [n for n, slot in enumerate(obj.material_slots) if slot.material is not None]
        same = [n for n in slots if obj.material_slots[n].material == entry.material]
        # the material may have moved to another slot since
        slot = entry.slot if entry.slot in same else next(iter(same), None)
        if slot is not None:
            found.append(FittedSlot(obj, slot))
    return found
