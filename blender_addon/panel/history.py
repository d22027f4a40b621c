# SPDX-License-Identifier: GPL-3.0-or-later
"""The results the active material had."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..result import history
from ..result.shown_result import VERDICT_ICONS
from ..sentences.translated import word
from ..text_width import text_width
from ..translations import CONTEXT
from .layout import ICON, UNIT, buttons_side_by_side, draw_sentence, fits, room
from .thumbnails import thumbnail

_AROUND = 26.0  # a list's margins and its bar, pixels at a scale of 1
_GAP = 6.0  # after the date
_ROWS = 4.0  # height of a picture, in rows of the interface


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
        when = item.name[5:16]
        reached = f"{item.flip:.3f}" if item.flip >= 0.0 else ""
        reached = word("partial") if item.partial else reached
        width = room(context) - _AROUND
        date = text_width(context, when) + ICON + _GAP
        has_number = fits(context, width - date - ICON, word("partial"), "0.000")
        split = layout.split(factor=min((date if has_number else width - ICON) / width, 1.0), align=True)
        split.label(text=when, icon="RADIOBUT_ON" if applied else "RADIOBUT_OFF")
        icon = VERDICT_ICONS.get(item.verdict, "BLANK1")
        split.label(text=reached if has_number else "", icon=icon, translate=False)


def _draw_pictures(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Reference and result of the marked one, as long as its job folder is there."""
    marked = history.chosen(context.object.active_material)
    folder = Path(marked.job_folder) / "pictures" / "thumbnails" if marked is not None else None
    icons = [thumbnail(folder / f"{name}.ppm") for name in ("reference", "result")] if folder is not None else []
    if not all(icons):
        return
    row = layout.row(align=True)
    for icon in icons:
        row.template_icon(icon_value=icon, scale=_ROWS)


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
        if context.scene.mfo.targets:  # the panels above are of all of them
            draw_sentence(layout, context, f"Of material {context.object.active_material.name}", "MATERIAL")
        layout.template_list(MFO_UL_history.bl_idname, "", kept, "history", kept, "history_index", rows=3)
        _draw_pictures(layout, context)
        row = layout.row(align=True)
        buttons = buttons_side_by_side(row, context, "Restore", "Show", taken=UNIT)
        buttons.operator("mfo.apply_past", text="Restore", icon="LOOP_BACK")
        buttons.operator("mfo.show_past", text="Show", icon="IMAGE_DATA")
        row.operator("mfo.remove_past", text="", icon="TRASH")
