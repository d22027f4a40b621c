# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a picture counts: a rectangle, a mask, the picture's own alpha; folded until it is asked for."""

from __future__ import annotations

import bpy

from ..sentences.translated import word
from .layout import BOX, ICON, NAMED_NUMBER, UNIT, fits, room

_EDGES = (("left", "right"), ("top", "bottom"))
_ARROW = 28.0  # of a heading that folds, pixels at a scale of 1


def draw_part(
    layout: bpy.types.UILayout, context: bpy.types.Context, part: bpy.types.PropertyGroup, number: int = 1
) -> None:
    """Draw the settings of one picture's part, counted from 1; a rectangle is drawn over the first one alone."""
    header, body = layout.panel(f"mfo_part_{number}", default_closed=True)
    words = word("Part That Counts")
    has_icon = not part.is_whole and fits(context, room(context) - _ARROW - 2 * UNIT - ICON, words)
    header.label(text="Part That Counts", icon="SELECT_SET" if has_icon else "NONE")
    if not part.is_whole:
        header.operator("mfo.whole_picture", text="", icon="X", emboss=False).number = number
    if body is None:
        return
    if number == 1:
        drawn = body.column()
        drawn.operator_context = "INVOKE_REGION_WIN"  # the rectangle is drawn in the view, not in the sidebar
        drawn.operator("mfo.draw_part", icon="SELECT_SET")
    column = body.column(align=True)
    texts = (f"{word(part.bl_rna.properties[name].name)} 100.0%" for names in _EDGES for name in names)
    beside = fits(context, (room(context) - BOX) / 2 - NAMED_NUMBER, *texts)
    for names in _EDGES:
        row = column.row(align=True) if beside else column
        for name in names:
            row.prop(part, name, slider=True)
    row = body.row(align=True)
    row.prop(part, "mask", text="")
    if number == 1:
        row.operator("mfo.paint_mask", text="", icon="BRUSH_DATA")
    body.prop(part, "use_alpha")
