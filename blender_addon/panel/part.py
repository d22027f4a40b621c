# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a picture counts: a rectangle, a mask, the picture's own alpha; folded until it is asked for."""

from __future__ import annotations

import bpy

from .layout import is_narrow, pair


def draw_part(
    layout: bpy.types.UILayout, context: bpy.types.Context, part: bpy.types.PropertyGroup, number: int = 1
) -> None:
    """Draw the settings of one picture's part, counted from 1; a rectangle is drawn over the first one alone."""
    header, body = layout.panel(f"mfo_part_{number}", default_closed=True)
    header.label(text="Part That Counts", icon="NONE" if part.is_whole or is_narrow(context) else "SELECT_SET")
    if not part.is_whole:
        header.operator("mfo.whole_picture", text="", icon="X", emboss=False).number = number
    if body is None:
        return
    if number == 1:
        drawn = body.column()
        drawn.operator_context = "INVOKE_REGION_WIN"  # the rectangle is drawn in the view, not in the sidebar
        drawn.operator("mfo.draw_part", icon="SELECT_SET")
    column = body.column(align=True)
    for names in (("left", "right"), ("top", "bottom")):
        row = pair(column, context)
        for name in names:
            row.prop(part, name, slider=True)
    row = body.row(align=True)
    row.prop(part, "mask", text="")
    if number == 1:
        row.operator("mfo.paint_mask", text="", icon="BRUSH_DATA")
    body.prop(part, "use_alpha")
