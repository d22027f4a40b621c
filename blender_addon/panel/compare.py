# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the result beside the reference, the errors, the curve, the check in Cycles."""

from __future__ import annotations

import bpy

from .. import comparison, cycles_check, previews
from .layout import draw_messages, draw_pictures, draw_sentence
from .result import draw_table


class Compare:
    """Look at what was found."""

    bl_label = "Compare"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Hidden until there is something to compare."""
        return context.window_manager.mfo_runtime.has_result

    def draw(self, context: bpy.types.Context) -> None:
        """Draw pictures, buttons and numbers."""
        layout, runtime = self.layout, context.window_manager.mfo_runtime  # type: ignore[attr-defined]  # from Panel
        if context.object is None or runtime.material != getattr(context.object.active_material, "name", ""):
            layout.label(text=f"Of material {runtime.material}", icon="MATERIAL")
        draw_pictures(layout, context, ("reference", "start", "result"), clickable=True)
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator("mfo.show_pictures", text="Side by Side", icon="IMAGE_DATA").show = "strip"
        row.operator("mfo.show_pictures", text="Split", icon="ARROW_LEFTRIGHT").show = "split"
        if comparison.has_split():
            column.prop(runtime, "split", slider=True)
        draw_table(layout, runtime.errors, "Error")
        _draw_cycles(layout, context, runtime)
        row = layout.row(align=True)
        row.operator("mfo.open_report", text="Report", icon="URL")
        row.operator("mfo.open_job", text="Open Job", icon="FILE_FOLDER")
        if previews.icon("curve"):
            header, body = layout.panel("mfo_curve", default_closed=True)
            header.label(text="Error over Time", icon="GRAPH")
            if body:
                body.template_icon(icon_value=previews.icon("curve"), scale=10.0)
                body.operator("mfo.show_pictures", text="Full Size", icon="FULLSCREEN_ENTER").show = "curve"
        if runtime.messages:
            header, body = layout.panel("mfo_notes", default_closed=True)
            header.label(text=f"Notes ({len(runtime.messages)})", icon="INFO")
            if body:
                draw_messages(body, context, runtime)


def _draw_cycles(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    column = layout.column()
    if cycles_check.is_running():
        row = column.row(align=True)
        row.label(text=runtime.cycles_text, icon="RENDER_STILL")
        row.operator("mfo.cancel_cycles", text="", icon="X")
        return
    column.operator("mfo.check_in_cycles", icon="RENDER_STILL")
    if runtime.cycles_text:
        failed = runtime.cycles_flip < 0.0
        line = column.column()
        line.alert = failed
        draw_sentence(line, context, runtime.cycles_text, "ERROR" if failed else "CHECKMARK")
    if previews.icon("cycles"):
        draw_pictures(column, context, ("reference", "cycles", "cycles_difference"), clickable=True)
