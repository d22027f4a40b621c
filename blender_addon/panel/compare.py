# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the result beside the reference, the check in Cycles, and folded what few ask for."""

from __future__ import annotations

import bpy

from ..pictures import comparison, previews
from ..result import shown_result
from ..running import cycles_check
from .cycles_render import draw_render
from .layout import buttons_side_by_side, draw_messages, draw_numbers, draw_pictures, draw_sentence


class Compare:
    """Look at what was found."""

    bl_label = "Compare"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Hidden until there is something to compare."""
        return context.window_manager.mfo_runtime.has_result

    def draw(self, context: bpy.types.Context) -> None:
        """Draw pictures and buttons."""
        layout, runtime = self.layout, context.window_manager.mfo_runtime  # type: ignore[attr-defined]  # from Panel
        fitted = shown_result.material()
        name = fitted.name if fitted is not None else runtime.material  # it may have another name by now
        if context.object is None or name != getattr(context.object.active_material, "name", ""):
            draw_sentence(layout, context, f"Of material {name}", "MATERIAL")
        if previews.icon("result"):
            _draw_result(layout, context, runtime)
        elif previews.icon("current"):
            draw_pictures(layout, context, ("reference", "current"))
        _draw_cycles(layout, context, runtime)
        row = buttons_side_by_side(layout, context, "Report", "Load Result")
        row.operator("mfo.open_report", text="Report", icon="URL")
        row.operator("mfo.open_job", text="Load Result", icon="FILE_FOLDER")
        header, body = layout.panel("mfo_numbers", default_closed=True)
        header.label(text="Details")
        if body:
            _draw_details(body, context, runtime)


def _draw_result(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    """What a fit that came to its end, or to its own way out, has left to look at."""
    draw_pictures(layout, context, ("reference", "result", "start"), clickable=True)
    _draw_each_picture(layout)
    column = layout.column(align=True)
    row = buttons_side_by_side(column, context, "Side by Side", "Split")
    row.operator("mfo.show_pictures", text="Side by Side", icon="IMAGE_DATA").show = "strip"
    row.operator("mfo.show_pictures", text="Split", icon="ARROW_LEFTRIGHT").show = "split"
    if comparison.has_split():
        column.prop(runtime, "split", slider=True)


def _draw_each_picture(layout: bpy.types.UILayout) -> None:
    """Of a fit of several pictures each one's verdict and error; a press shows it side by side."""
    found = shown_result.result
    if found is None or not found.pictures:
        return
    column = layout.column(align=True)
    for picture in found.pictures:
        icon = shown_result.VERDICT_ICONS.get(picture.verdict, "IMAGE_DATA")
        row = column.row(align=True)
        text = f"{picture.label}: FLIP {picture.flip[1]:.3f}"
        shown = row.operator("mfo.show_pictures", text=text, icon=icon)
        shown.show, shown.job_folder = "strip", str(picture.folder)


def _draw_details(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    """Errors, the curve, which values could be traded, and the notes."""
    draw_numbers(layout, runtime.errors)
    if previews.icon("curve"):
        layout.template_icon(icon_value=previews.icon("curve"), scale=10.0)
        layout.operator("mfo.show_pictures", text="Error over Time", icon="FULLSCREEN_ENTER").show = "curve"
    found = shown_result.result
    for sentence in found.weak_combinations if found is not None else ():
        draw_sentence(layout, context, sentence, "QUESTION")
    draw_messages(layout, context, runtime)


def _draw_cycles(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    column = layout.column()
    if not cycles_check.is_running() or runtime.cycles_of_reference:
        column.operator("mfo.check_in_cycles", icon="RENDER_STILL")
    if not runtime.cycles_of_reference:
        draw_render(column, context)
    if previews.icon("cycles"):
        draw_pictures(column, context, ("reference", "cycles", "cycles_difference"), clickable=True)
    if previews.icon("engine"):
        draw_pictures(column, context, ("cycles", "engine", "engine_difference"), clickable=True)
