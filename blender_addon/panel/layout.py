# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces the panels are made of: sentences that wrap, buttons beside or below each other, pictures with their names.

Blender cuts a text that is wider than its label or button, so what stands beside what is chosen by the texts' widths.
All widths are in pixels at a scale of 1. What margins and icons take was measured in windows of Blender 5.2: texts of
rising width in each kind of item, and the last that was not cut.
"""

from __future__ import annotations

import bpy

from ..pictures import previews
from ..sentences.translated import translated, word
from ..text_width import text_width, ui_scale, wrapped

UNIT = 20.0  # height of a row and width of an icon's button
ICON = 25.0  # an icon before a text, with its margins
BUTTON = 5.0  # margins of a button's text
NUMBER = 60.0  # a number as 0.500 with its margins
NAMED_NUMBER = 40.0  # margins and arrows of a number with its name, without both
GAP = 8.0  # between the items of a row
LABEL = 3.0  # margins of a label
BOX = 16.0  # margins of a box
_AROUND = 52.0  # margins of a panel and the tabs of the sidebar
_LEAST = 100.0  # of a panel in a region that has no width yet
_LARGEST = 10.0  # rows that a picture takes
_LARGEST_PAIR = 15.0  # rows that two take: no more than a thumbnail of a fit that runs has pixels
_LABELS = {
    "current": "Preliminary",
    "cycles": "In Cycles",
    "cycles_difference": "Difference",
    "engine": "Own Engine",
    "engine_difference": "Difference",
}
_SHORT = {
    "reference": "Goal",
    "current": "Current",
    "difference": "Error",
    "cycles": "Cycles",
    "cycles_difference": "Error",
    "engine": "Own",
    "engine_difference": "Error",
}  # where the names have no room


def draw_sentence(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str, *, taken: float = 0.0
) -> None:
    """A sentence in the user's language over as many lines as the region needs; labels do not wrap.

    `taken`: width of what stands beside it.
    """
    column = layout.column(align=True)
    column.scale_y = 0.8
    width = room(context) - taken - BOX - ICON
    for i, line in enumerate(wrapped(context, translated(text), width)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


def room(context: bpy.types.Context) -> float:
    """Width of what a panel holds."""
    return max(context.region.width / ui_scale(context) - _AROUND, _LEAST)


def fits(context: bpy.types.Context, width: float, *texts: str) -> bool:
    """Whether each of the texts, as they are shown, has room in a width."""
    return all(text_width(context, text) <= width for text in texts)


def side_by_side(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    *texts: str,
    margins: float = ICON,
    taken: float = 0.0,
) -> bpy.types.UILayout:
    """Where items with these texts, as they are shown, belong: beside each other, or below where one would be cut.

    `margins`: of each one's text, `taken`: by what else is in the line.
    """
    beside = fits(context, (room(context) - taken) / len(texts) - margins, *texts)
    return layout.row(align=True) if beside else layout.column(align=True)


def buttons_side_by_side(
    layout: bpy.types.UILayout, context: bpy.types.Context, *names: str, taken: float = 0.0
) -> bpy.types.UILayout:
    """The same for buttons of operators with an icon, by their English names."""
    return side_by_side(layout, context, *(word(name, "Operator") for name in names), taken=taken)


def names_of(data: bpy.types.bpy_struct, choice: str) -> list[str]:
    """Names of the items of an enumeration, as they are shown."""
    return [word(item.name) for item in data.bl_rna.properties[choice].enum_items]


def draw_pictures(
    layout: bpy.types.UILayout, context: bpy.types.Context, names: tuple[str, ...], *, clickable: bool = False
) -> None:
    """Pictures, of which the first two are compared; with `clickable` their names are buttons that show each in full.

    Blender draws a picture into a square. The two share one where that leaves less of it empty, as large as the panel
    is wide, and of the others there are the buttons; else all have one each, side by side.
    """
    pair = previews.pair(*names[:2])
    if pair is None:
        row, labels = layout.row(align=True), _labels(context, names)
        for name, label in zip(names, labels, strict=True):
            column = row.column(align=True)
            if previews.icon(name):
                column.template_icon(icon_value=previews.icon(name), scale=_rows(context, len(names), _LARGEST))
            _draw_name(column, name, label, clickable=clickable)
        return
    icon, is_stacked = pair
    column, scale = layout.column(align=True), _rows(context, 1, _LARGEST_PAIR)
    if is_stacked:
        first, second = _labels(context, names[:1]) + _labels(context, names[1:2])
        _draw_name(column, names[0], first, clickable=clickable)
        column.template_icon(icon_value=icon, scale=scale)
        _draw_name(column, names[1], second, clickable=clickable)
    else:
        column.template_icon(icon_value=icon, scale=scale)
        row = column.row(align=True)
        for name, label in zip(names, _labels(context, names[:2]), strict=False):
            _draw_name(row.column(), name, label, clickable=clickable)
    if clickable:
        row = layout.row(align=True)
        for name, label in zip(names[2:], _labels(context, names[2:]), strict=True):
            _draw_name(row, name, label, clickable=True)


def _labels(context: bpy.types.Context, names: tuple[str, ...]) -> list[str]:
    """What pictures beside each other are called, shorter where that would be cut."""
    labels = [translated(_LABELS.get(name, name.title())) for name in names]
    if fits(context, room(context) / len(names) - BUTTON, *labels):
        return labels
    return [translated(_SHORT.get(name, name.title())) for name in names]


def _draw_name(layout: bpy.types.UILayout, name: str, label: str, *, clickable: bool) -> None:
    if clickable:
        layout.operator("mfo.show_pictures", text=label).show = name
        return
    line = layout.row()
    line.alignment = "CENTER"
    line.label(text=label)


def _rows(context: bpy.types.Context, pictures: int, largest: float) -> float:
    """Height of a square that is as wide as its share of the panel, in rows of the interface."""
    return min(max(room(context) / pictures / UNIT, 2.0), largest)


def draw_numbers(layout: bpy.types.UILayout, rows: bpy.types.bpy_prop_collection) -> None:
    """Errors at the start and of the result."""
    if not rows:
        return
    grid = layout.column(align=True)  # a box would take the room of a narrow sidebar
    for name, *numbers in (("Error", "Start", "Result"), *((row.name, row.start, row.result) for row in rows)):
        split = grid.split(factor=0.37, align=True)
        split.label(text=translated(name))
        columns = split.split(factor=0.5, align=True)
        for number in numbers:
            columns.label(text=number)


def draw_messages(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    """The notes of a fit."""
    column = layout.column(align=True)
    for message in runtime.messages:
        draw_sentence(column, context, message.name, message.icon or "INFO")
