# SPDX-License-Identifier: GPL-3.0-or-later
"""The axes that tangents of an object's faces circle, where its materials turn highlights along them."""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from ..findings import Findings
from ..nodes.circling import keeps_place, turned_axis
from .read_mesh import material_of_slot, slot_count


class CircledAxes:
    """Axes by names of materials: those of `fitted` ones, which a fit may turn yet, and of others that are turned."""

    def __init__(self, fitted: Mapping[str, str], findings: Findings) -> None:
        self._known, self._findings = dict(fitted), findings

    def of(self, item: bpy.types.Object) -> list[str]:
        """X, Y, Z or nothing for each slot of an object; what Cycles has otherwise is named."""
        return [self._axis(item, material_of_slot(item, slot)) for slot in range(slot_count(item))]

    def _axis(self, item: bpy.types.Object, material: bpy.types.Material | None) -> str:
        if material is None:
            return ""
        own = material.original
        if own.name_full not in self._known:
            self._known[own.name_full] = turned_axis(own)
        axis = self._known[own.name_full]
        if axis and not keeps_place(item) and turned_axis(own):
            self._findings.note(
                f"Material '{own.name}' turns its highlights about an axis of '{item.name}': in the fit about that of "
                "its faces as they are, in Cycles as they were before they were deformed."
            )
        return axis
