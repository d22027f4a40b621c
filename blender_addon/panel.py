# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar of the 3D view, in the order of the work: reference, what to fit, run, compare, apply.

`draw` only reads properties and icons that exist; it touches no file.
"""

from __future__ import annotations

import textwrap

import bpy

from . import previews
from .backend_section import draw_setup, has_trouble, needs_setup
from .operators.pictures import job_folder_of
from .properties import chosen_of


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Material Fit"


# levels of result.json: icon before the value, and its meaning in the legend
_CERTAINTY = {
    "determined": ("CHECKMARK", "determined by the picture"),
    "weak": ("QUESTION", "weakly determined"),
    "not_visible": ("HIDE_ON", "not visible, kept as it was"),
}


class MFO_PT_fit(_Panel, bpy.types.Panel):
    """Reference, settings and the run."""

    bl_idname = "MFO_PT_fit"
    bl_label = "Material Fit"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings and the button or the progress."""
        layout = self.layout
        settings, runtime = context.scene.mfo, context.window_manager.mfo_runtime
        running = runtime.state in {"RUNNING", "CANCELLING"}
        _draw_target(layout, context)

        column = layout.column()
        column.enabled = not running
        column.row().prop(settings, "reference_source", expand=True)
        if settings.reference_source == "FILE":
            column.prop(settings, "reference_path", text="")
        else:
            column.template_ID(settings, "reference_image", open="image.open")
        column.separator()
        column.use_property_split, column.use_property_decorate = True, False
        column.prop(settings, "preset")
        column.prop(settings, "parameter_set")
        if settings.parameter_set == "chosen":
            column.column(align=True).prop(settings, chosen_of(settings.model), text="Values")
        header, body = column.panel("mfo_advanced", default_closed=True)
        header.label(text="Advanced")
        if body:
            body.prop(settings, "model")
            body.prop(settings, "range")
            body.prop(settings, "bake_view")
            body.prop(settings, "max_iterations")

        layout.separator()
        if running:
            _draw_progress(layout, runtime)
        elif needs_setup():
            draw_setup(layout, width=_letters(context))
        else:
            row = layout.row(align=True)
            row.scale_y = 1.4
            row.operator("mfo.fit", icon="PLAY")
            row.operator("mfo.check", text="", icon="VIEWZOOM")
            if has_trouble():
                draw_setup(layout, width=_letters(context))
        if runtime.state in {"DONE", "FAILED"}:
            box = layout.box()
            box.alert = runtime.state == "FAILED"
            _wrapped(box, context, runtime.sentence, "ERROR" if runtime.state == "FAILED" else "CHECKMARK")
        if runtime.messages and (runtime.checked or not runtime.has_result):
            _draw_messages(layout.box(), context, runtime)


class MFO_PT_result(_Panel, bpy.types.Panel):
    """Pictures, numbers, Apply and Revert."""

    bl_idname = "MFO_PT_result"
    bl_label = "Result"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Hidden until there is something to compare or to revert."""
        return context.window_manager.mfo_runtime.has_result or bool(job_folder_of(context))

    def draw(self, context: bpy.types.Context) -> None:
        """Draw pictures, table and buttons."""
        layout, runtime = self.layout, context.window_manager.mfo_runtime
        if runtime.has_result:
            if context.object is None or runtime.material != getattr(context.object.active_material, "name", ""):
                layout.label(text=f"Of material {runtime.material}", icon="MATERIAL")
            _draw_pictures(layout, ("reference", "start", "result"))
        row = layout.row(align=True)
        row.scale_y = 1.4
        row.operator("mfo.apply", text="Apply", icon="CHECKMARK")
        row.operator("mfo.revert", text="Revert", icon="LOOP_BACK")
        row = layout.row(align=True)
        row.operator("mfo.show_pictures", text="Compare", icon="IMAGE_DATA")
        row.operator("mfo.open_report", text="Report", icon="URL")
        if runtime.has_result:
            _draw_table(layout, runtime.errors, "Error")
            _draw_table(layout, runtime.values, "Value")
            if runtime.messages and not runtime.checked:
                header, body = layout.panel("mfo_notes", default_closed=True)
                header.label(text=f"Notes ({len(runtime.messages)})", icon="INFO")
                if body:
                    _draw_messages(body, context, runtime)


def _draw_target(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    obj = context.object
    if obj is None:
        layout.label(text="Select an object", icon="ERROR")
        return
    material = obj.active_material
    row = layout.row()
    row.label(text=obj.name, icon="OBJECT_DATA")
    row.label(text=material.name if material else "No material", icon="MATERIAL" if material else "ERROR")


def _draw_progress(layout: bpy.types.UILayout, runtime: bpy.types.PropertyGroup) -> None:
    row = layout.row(align=True)
    row.scale_y = 1.4
    row.progress(factor=runtime.fraction, type="BAR", text=runtime.progress_text)
    row.operator("mfo.cancel", text="", icon="X")
    if runtime.detail:
        layout.label(text=runtime.detail)
    if previews.icon("current"):
        _draw_pictures(layout, ("reference", "current"))


def _draw_messages(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    column = layout.column(align=True)
    for message in runtime.messages:
        _wrapped(column, context, message.name, message.icon or "INFO")


def _draw_pictures(layout: bpy.types.UILayout, names: tuple[str, ...]) -> None:
    row = layout.row(align=True)
    for name in names:
        column = row.column(align=True)
        if previews.icon(name):
            column.template_icon(icon_value=previews.icon(name), scale=5.0)
        label = column.row()
        label.alignment = "CENTER"
        label.label(text=name.title())


def _draw_table(layout: bpy.types.UILayout, rows: bpy.types.bpy_prop_collection, title: str) -> None:
    if not rows:
        return
    box = layout.box()
    grid = box.column(align=True)
    known = any(row.certainty for row in rows)
    lines = ((title, "Start", "Result", ""), *((row.name, row.start, row.result, row.certainty) for row in rows))
    for name, *cells, certainty in lines:
        split = grid.split(factor=0.5 if known else 0.46)
        split.label(text=name, **({"icon": _CERTAINTY.get(certainty, ("BLANK1",))[0]} if known else {}))
        columns = split.split(factor=0.5)  # a row would pack swatches to the left
        for cell in cells:
            swatch = previews.icon(cell)  # colours have one, and no room for their hex code beside it
            columns.label(text="" if swatch else cell, icon_value=swatch)
    if known:
        legend = box.column(align=True)
        legend.scale_y = 0.8
        for level in dict.fromkeys(row.certainty for row in rows if row.certainty in _CERTAINTY):
            icon, words = _CERTAINTY[level]
            legend.label(text=words, icon=icon)


def _letters(context: bpy.types.Context) -> int:
    """How many letters a line of the sidebar holds."""
    scale = context.preferences.system.ui_scale
    return max(16, int((context.region.width / scale - 75) / 5.8))  # 5.8 px is an average letter at scale 1


def _wrapped(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str) -> None:
    """A sentence over as many lines as the sidebar needs; labels do not wrap."""
    width = _letters(context)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(text, width) or [""]):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


CLASSES = (MFO_PT_fit, MFO_PT_result)
