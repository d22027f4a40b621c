# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply, Revert and A/B, and the recovered values with how sure each is."""

from __future__ import annotations

import bpy

from .. import previews, shown_result
from ..animated_sockets import animation_of
from ..export.target_shader import target_shader
from ..job_result import must_ask
from .layout import draw_sentence

# levels of result.json: icon before the value, and its meaning in the legend
_CERTAINTY = {
    "determined": ("RADIOBUT_ON", "determined by the picture"),
    "weak": ("QUESTION", "weakly determined"),
    "not_visible": ("HIDE_ON", "not visible, kept as it was"),
    "not_told_apart": ("ARROW_LEFTRIGHT", "not told apart from others"),
    "doubtful": ("ERROR", "doubtful: no match"),
}


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
        column = layout.column(align=True)
        row = column.row(align=True)
        row.scale_y = 1.4
        asked = must_ask(runtime.verdict) and runtime.asked == runtime.job_folder
        row.operator("mfo.apply", text="Apply Anyway" if asked else "Apply", icon="PASTEDOWN")
        row.operator("mfo.revert", text="Revert", icon="LOOP_BACK")
        applied = material is not None and bool(material.mfo.originals)
        shows_own = material is not None and applied and material.mfo.shows_original
        text = ("A: own values" if shows_own else "B: recovered values") if applied else "A/B"
        target = target_shader(material)
        if target is not None and animation_of(target.sockets):
            layout.label(text="Animated values", icon="ANIM")
            row = layout.row()
            row.prop(context.scene.mfo, "animated", expand=True)
        column.operator("mfo.toggle", text=text, icon="ARROW_LEFTRIGHT", depress=applied and not shows_own)
        if runtime.has_result:
            draw_table(layout, runtime.values, "Value")
            found = shown_result.result
            for sentence in found.weak_combinations if found is not None else ():
                draw_sentence(layout, context, sentence, "QUESTION")


def draw_table(layout: bpy.types.UILayout, rows: bpy.types.bpy_prop_collection, title: str) -> None:
    """Names with the numbers or colours of the start and the result, and a legend of how sure they are."""
    if not rows:
        return
    box = layout.box()
    grid = box.column(align=True)
    known = any(row.certainty for row in rows)
    lines = ((title, "Start", "Result", ""), *((row.name, row.start, row.result, row.certainty) for row in rows))
    for name, *cells, certainty in lines:
        split = grid.split(factor=0.55 if known else 0.46)
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
