# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces the panels are made of: sentences that wrap and pictures with a name below."""

from __future__ import annotations

import textwrap

import bpy

from ..result import previews
from ..sentences.translated import translated

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
    "cycles_difference": "Error",
    "engine": "Own",
    "engine_difference": "Error",
}  # where three names have little room
_LETTERS_OF_A_BOX = 3  # that its margins take; in a window a list of sockets' names was cut without them
_LETTERS_OF_A_ROW = 27  # of a line that holds two buttons uncut; a narrower side bar has one below the other


def draw_sentence(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str) -> None:
    """A sentence in the user's language over as many lines as the region needs; labels do not wrap."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for i, line in enumerate(textwrap.wrap(translated(text), letters(context) - _LETTERS_OF_A_BOX) or [""]):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


def letters(context: bpy.types.Context) -> int:
    """How many letters a line of the region holds."""
    scale = context.preferences.system.ui_scale
    return max(16, int((context.region.width / scale - 80) / 5.8))  # 5.8 px is an average letter at scale 1


def is_narrow(context: bpy.types.Context) -> bool:
    """Whether two buttons beside each other would have their names cut."""
    return letters(context) < _LETTERS_OF_A_ROW


def pair(layout: bpy.types.UILayout, context: bpy.types.Context) -> bpy.types.UILayout:
    """Where two buttons belong: beside each other, or below where there is no room."""
    return layout.column(align=True) if is_narrow(context) else layout.row(align=True)


def draw_pictures(
    layout: bpy.types.UILayout, context: bpy.types.Context, names: tuple[str, ...], *, clickable: bool = False
) -> None:
    """Pictures side by side; with `clickable` their names are buttons that show them at full size."""
    row = layout.row(align=True)
    scale = _icon_scale(context, len(names))
    for name in names:
        column = row.column(align=True)
        if previews.icon(name):
            column.template_icon(icon_value=previews.icon(name), scale=scale)
        label = _LABELS.get(name, name.title())
        if is_narrow(context) and len(names) > 2:
            label = _SHORT.get(name, label)
        label = translated(label)
        if clickable:
            column.operator("mfo.show_pictures", text=label).show = name
        else:
            line = column.row()
            line.alignment = "CENTER"
            line.label(text=label)


def _icon_scale(context: bpy.types.Context, pictures: int) -> float:
    """Height of an icon, in rows of the interface, that is as wide as its share of the region: no empty bands."""
    width = context.region.width / context.preferences.system.ui_scale - 60  # without margins and tabs
    return min(max(width / pictures / 20, 2.0), 10.0)  # a row is 20 px at scale 1


def draw_numbers(layout: bpy.types.UILayout, rows: bpy.types.bpy_prop_collection) -> None:
    """Errors at the start and of the result."""
    if not rows:
        return
    grid = layout.box().column(align=True)
    for name, *numbers in (("Error", "Start", "Result"), *((row.name, row.start, row.result) for row in rows)):
        split = grid.split(factor=0.46)
        split.label(text=translated(name))
        columns = split.split(factor=0.5)
        for number in numbers:
            columns.label(text=number)


def draw_messages(layout: bpy.types.UILayout, context: bpy.types.Context, runtime: bpy.types.PropertyGroup) -> None:
    """The notes of a fit."""
    column = layout.column(align=True)
    for message in runtime.messages:
        draw_sentence(column, context, message.name, message.icon or "INFO")
