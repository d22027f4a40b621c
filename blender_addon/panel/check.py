# SPDX-License-Identifier: GPL-3.0-or-later
"""The check before a run: what stops it, what is ignored, what is fine, each problem with its remedies."""

from __future__ import annotations

import bpy

from .. import preflight, running_job
from ..checks import FINE, IGNORED, STOPS, TO_CHOOSE, Finding
from ..mending import KINDS
from .layout import draw_sentence

_ICONS = {STOPS: "ERROR", TO_CHOOSE: "FORWARD", IGNORED: "INFO", FINE: "CHECKMARK"}


class Check:
    """The list of findings."""

    bl_label = ""

    def draw_header(self, _context: bpy.types.Context) -> None:
        """Say in the heading whether anything stops the fit."""
        words, icon = preflight.summary()
        self.layout.label(text=words, icon=icon)  # type: ignore[attr-defined]  # from Panel

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Hidden while a fit runs: its job has been exported, and the pictures need the room."""
        return running_job.current is None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list and the button that reads the whole scene."""
        layout = self.layout  # type: ignore[attr-defined]
        folded = preflight.by_export()
        column = layout.column()
        for finding in preflight.findings:
            if finding not in folded:
                _draw_finding(column, context, finding)
        if folded:
            header, body = layout.panel("mfo_left_out", default_closed=True)
            header.label(text=f"Left out by the export ({len(folded)})", icon="INFO")
            for finding in folded if body else ():
                _draw_finding(body, context, finding)
        text = "Check Everything Again" if preflight.is_thorough else "Check Everything"
        layout.operator("mfo.check", text=text, icon="VIEWZOOM")


def _draw_finding(layout: bpy.types.UILayout, context: bpy.types.Context, finding: Finding) -> None:
    column = layout.column(align=True)
    column.alert = finding.level == STOPS
    draw_sentence(column, context, finding.sentence, _ICONS[finding.level])
    if finding.fixes:
        buttons = layout.column(align=True)
        for fix in finding.fixes:
            button = buttons.operator("mfo.mend", text=KINDS[fix.kind].label.format(fix.argument), icon="TOOL_SETTINGS")
            button.kind, button.argument = fix.kind, fix.argument
