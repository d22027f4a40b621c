# SPDX-License-Identifier: GPL-3.0-or-later
"""The results the active material had."""

from __future__ import annotations

import bpy

from ..result.shown_result import VERDICT_ICONS
from ..translations import CONTEXT
from .layout import is_narrow, pair


class MFO_UL_history(bpy.types.UIList):
    """One line for each result: when, its verdict, and the FLIP it reached."""

    bl_idname = "MFO_UL_history"

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: bpy.types.PropertyGroup,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: object,
        _active_property: str,
    ) -> None:
        """Draw one result; the one on the material has a full dot, one that looks the same a check mark."""
        applied = item.job_folder == data.job_folder and not data.shows_original
        narrow = is_narrow(context)
        split = layout.split(factor=0.82 if narrow else 0.62)  # a day and a time, a verdict and its number
        split.label(text=item.name[5:16], icon="RADIOBUT_ON" if applied else "RADIOBUT_OFF")
        reached = f"{item.flip:.3f}" if item.flip >= 0.0 else ""
        split.label(
            text="" if narrow else "partial" if item.partial else reached,
            icon=VERDICT_ICONS.get(item.verdict, "BLANK1"),
        )


class History:
    """Go back to an earlier result."""

    bl_label = "History"
    bl_translation_context = CONTEXT

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Hidden until the material has results."""
        material = context.object.active_material if context.object else None
        return material is not None and bool(material.mfo.history)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list and what can be done with the marked result."""
        layout, kept = self.layout, context.object.active_material.mfo  # type: ignore[attr-defined]  # from Panel
        layout.template_list(MFO_UL_history.bl_idname, "", kept, "history", kept, "history_index", rows=3)
        row = layout.row(align=True)
        buttons = pair(row, context)
        buttons.operator("mfo.apply_past", text="Restore", icon="LOOP_BACK")
        buttons.operator("mfo.show_past", text="Show", icon="IMAGE_DATA")
        row.operator("mfo.remove_past", text="", icon="TRASH")
