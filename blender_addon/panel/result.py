# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply, Revert and A/B, and the recovered values, each with a bar that says how sure it is."""

from __future__ import annotations

from itertools import groupby

import bpy

from ..export.nodes.target_shader import target_shader
from ..pictures import previews
from ..result import shown_result
from ..result.animated_sockets import animation_of
from ..result.job_result import must_ask
from ..sentences.translated import translated, word
from .layout import BOX, BUTTON, ICON, draw_sentence, fits, room, side_by_side

_NUMBER = "-0.123"  # which a narrow sidebar holds; where it does not hold three columns, it has no start
_NAME_OF_TWO, _NAME_OF_THREE = 0.66, 0.52  # share of the name beside its values
_GAP = 7.0  # that Blender keeps beside a column, although it is aligned: 47 pixels of a bar where 54 are its share
_KEPT = "not_visible"  # level of what stays as it was


class Result:
    """Put the values on the material, or take them away."""

    bl_label = "Result"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Hidden until there is something to apply or to revert."""
        material = context.object.active_material if context.object else None
        applied = material is not None and bool(material.mfo.originals)
        return context.window_manager.mfo_runtime.has_result or applied

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the buttons and the table of values."""
        layout, runtime = self.layout, context.window_manager.mfo_runtime  # type: ignore[attr-defined]  # from Panel
        material = context.object.active_material if context.object else None
        target = target_shader(material)
        if target is not None and animation_of(target.sockets):
            layout.label(text="Animated values", icon="ANIM")
            layout.row().prop(context.scene.mfo, "animated", expand=True)
        column = layout.column(align=True)
        row = column.row(align=True)
        row.scale_y = 1.4
        asked = must_ask(runtime.verdict) and runtime.asked == runtime.job_folder
        row.operator("mfo.apply", text="Apply Anyway" if asked else "Apply", icon="PASTEDOWN")
        applied = material is not None and bool(material.mfo.originals)
        shows_own = material is not None and applied and material.mfo.shows_original
        text = ("A: Own" if shows_own else "B: Recovered") if applied else "A/B"
        row = side_by_side(column, context, translated(text), word("Revert", "Operator"))
        row.operator("mfo.toggle", text=translated(text), icon="ARROW_LEFTRIGHT", depress=applied and not shows_own)
        row.operator("mfo.revert", text="Revert", icon="LOOP_BACK")
        column.operator("mfo.save_as_asset", icon="ASSET_MANAGER")
        if runtime.has_result:
            _draw_materials(layout, runtime)
            _draw_values(layout, context, runtime.values)
            _draw_next_picture(layout, context)


def _draw_materials(layout: bpy.types.UILayout, runtime: bpy.types.PropertyGroup) -> None:
    """The materials that were fitted together, each with its verdict; a press shows its values and pictures."""
    if not runtime.materials:
        return
    column = layout.box().column(align=True)
    for index, row in enumerate(runtime.materials):
        line = column.row(align=True)
        icon = shown_result.VERDICT_ICONS.get(row.words, "BLANK1")
        shown = index == runtime.shown_material
        line.operator("mfo.show_material", text=row.name, icon=icon, depress=shown, translate=False).index = index
        line.label(text=row.result)


def _draw_values(layout: bpy.types.UILayout, context: bpy.types.Context, rows: bpy.types.bpy_prop_collection) -> None:
    """Names, starts and results; what the picture does not show is one sentence."""
    kept = [row.name for row in rows if row.certainty == _KEPT]
    has_start = fits(context, _number_width(context, has_start=True), word("Start"), word("Result"), _NUMBER)
    box = layout.box()
    grid = box.column(align=True)
    name, start, result = _cells(grid, has_start)
    name.operator("mfo.copy_values", text="Copy", icon="COPYDOWN", emboss=False)
    if start is not None:
        start.label(text="Start")
    result.label(text="Result")
    found = [row for row in rows if row.certainty != _KEPT]
    for node, values in groupby(found, lambda row: row.name.rpartition("/")[0]):
        if node:
            grid.label(text=node, icon="NODE")
        for row in values:
            _draw_row(grid, context, row, has_start)
    if any(row.sureness >= 0.0 for row in rows):
        draw_sentence(box, context, "Bar: how sure the value is.", "INFO")
    if kept:
        draw_sentence(box, context, f"Not visible in the picture, kept: {', '.join(kept)}.", "HIDE_ON")


def _draw_next_picture(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Which further picture would tell more, and a button that sets its camera or light up."""
    found = shown_result.result
    if found is None or found.next_picture is None:
        return
    box, light = layout.box(), found.next_picture.light
    draw_sentence(box, context, found.next_picture.sentence, "LIGHT" if light else "CAMERA_DATA")
    icon = "LIGHT" if light else "VIEW_CAMERA"
    box.operator("mfo.set_up_next_picture", text="Set Up Light" if light else "Set Up Camera", icon=icon)


def _draw_row(
    grid: bpy.types.UILayout, context: bpy.types.Context, row: bpy.types.PropertyGroup, has_start: bool
) -> None:
    """One value; a name that its cell would cut has a line of its own."""
    text, is_doubtful = word(row.name.rpartition("/")[2]), row.certainty == "doubtful"
    cell = (room(context) - BOX) * (_NAME_OF_THREE if has_start else _NAME_OF_TWO)
    beside = fits(context, cell - (ICON if is_doubtful else BUTTON), text)
    line = None if beside else grid.row()
    name, start, result = _cells(grid, has_start)
    if line is not None:
        name.label(text="")
        name, name.alignment = line, "LEFT"
    icon = "ERROR" if is_doubtful else "NONE"
    name.operator("mfo.copy_values", text=text, icon=icon, emboss=False, translate=False).name = row.name
    width = _number_width(context, has_start=has_start) - _GAP
    if start is not None:
        _draw_value(start, _shortened(context, row.start, width), -1.0)
    _draw_value(result, _shortened(context, row.result, width), row.sureness)


def _number_width(context: bpy.types.Context, *, has_start: bool) -> float:
    """What a column of values has for a number and its margins."""
    share = (1.0 - _NAME_OF_THREE) / 2 if has_start else 1.0 - _NAME_OF_TWO
    return (room(context) - BOX) * share - BUTTON


def _shortened(context: bpy.types.Context, shown: str, width: float) -> str:
    """A number with as many of its digits as have room; a press copies all of them."""
    if not shown or shown.startswith("#") or fits(context, width, shown):
        return shown
    value = float(shown)
    fewer, fewest = (f"{value:{digits}}" for digits in ((".0f", ".0e") if abs(value) >= 1.0 else (".2g", ".1g")))
    return fewer if fits(context, width, fewer) else fewest.replace("e+0", "e").replace("e-0", "e-")


def _cells(
    grid: bpy.types.UILayout, has_start: bool
) -> tuple[bpy.types.UILayout, bpy.types.UILayout | None, bpy.types.UILayout]:
    """Layouts for the name, the start and the result of one line."""
    split = grid.split(factor=_NAME_OF_THREE if has_start else _NAME_OF_TWO, align=True)
    name = split.row()
    name.alignment = "LEFT"
    if not has_start:
        return name, None, split.row(align=True)
    columns = split.split(factor=0.5, align=True)
    return name, columns.row(align=True), columns.row(align=True)


def _draw_value(cell: bpy.types.UILayout, shown: str, sureness: float) -> None:
    """A number or a swatch, over a bar where it is known how sure it is."""
    swatch = previews.icon(shown)
    if sureness < 0.0:
        cell.label(text="" if swatch else shown, icon_value=swatch)
        return
    if swatch:
        cell.label(text="", icon_value=swatch)
    cell.progress(factor=sureness, type="BAR", text="" if swatch else shown)
