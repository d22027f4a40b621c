# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a render in Cycles beside this Blender is, and what came of it."""

from __future__ import annotations

import bpy

from ..running import cycles_check
from .layout import GAP, UNIT, draw_sentence


def draw_render(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What is done and its cross; when it has ended the figure, which is no verdict, or why it failed."""
    runtime = context.window_manager.mfo_runtime
    if cycles_check.is_running():
        row = layout.row()
        draw_sentence(row, context, runtime.cycles_text, "RENDER_STILL", taken=UNIT + GAP)
        row.operator("mfo.cancel_cycles", text="", icon="X")
    elif runtime.cycles_text:
        failed = runtime.cycles_flip < 0.0
        line = layout.column()
        line.alert = failed
        draw_sentence(line, context, runtime.cycles_text, "ERROR" if failed else "INFO")
