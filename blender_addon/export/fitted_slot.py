# SPDX-License-Identifier: GPL-3.0-or-later
"""A material slot whose material is fitted, and whether several may be fitted together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from .findings import ExportError

MOST_TARGETS = 64  # as the backend's `job.folder.request`


@dataclass(frozen=True)
class FittedSlot:
    """A slot of an object; `slot` counts from 0, `leaf` names the shader of a mix that is fitted."""

    object: bpy.types.Object
    slot: int
    leaf: str | None = None

    @property
    def material(self) -> bpy.types.Material | None:
        """Its material, if it has one."""
        slots = self.object.material_slots
        return slots[self.slot].material if 0 <= self.slot < len(slots) else None

    @staticmethod
    def active(obj: bpy.types.Object) -> FittedSlot:
        """The active slot of an object."""
        return FittedSlot(obj, obj.active_material_index)


def check_slots(slots: Sequence[FittedSlot]) -> None:
    """Raise `ExportError` where a material is named twice, by one slot or by two, or there are too many."""
    if len(slots) > MOST_TARGETS:
        raise ExportError(f"There are {len(slots)} materials: at most {MOST_TARGETS} are fitted together.")
    known: dict[str, FittedSlot] = {}
    for each in slots:
        material = each.material
        if material is None:
            continue  # said by name where the scene is read
        first = known.get(material.name_full)
        if first is None:
            known[material.name_full] = each
            continue
        if (first.object, first.slot) == (each.object, each.slot):
            raise ExportError(
                f"Slot {each.slot + 1} of '{each.object.name}' (material '{material.name}') is named twice: name it "
                "once."
            )
        raise ExportError(
            f"Material '{material.name}' is named twice, in slot {first.slot + 1} of '{first.object.name}' and in "
            f"slot {each.slot + 1} of '{each.object.name}': its values are the same in both, so name one of them."
        )
