# SPDX-License-Identifier: GPL-3.0-or-later
"""The check before a run: what stops it and what it changes, with its remedies; the rest is folded."""

from __future__ import annotations

import bpy

from ..check import preflight
from ..check.finding import FINE, IGNORED, STOPS, TO_CHOOSE, Finding
from ..check.mending import KINDS
from ..running import running_job
from ..sentences.translated import translated
from .layout import draw_sentence

_ICONS = {STOPS: "ERROR", TO_CHOOSE: "FORWARD", IGNORED: "INFO", FINE: "CHECKMARK"}


class Check:
    """The list of findings."""

    bl_label = ""

    def draw_header(self, _context: bpy.types.Context) -> None:
        """Say in the heading whether anything stops the fit."""
        words, icon = preflight.summary()
        self.layout.label(text=translated(words), icon=icon)  # type: ignore[attr-defined]  # from Panel

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Hidden while a fit runs: its job has been exported, and the pictures need the room."""
        return running_job.current is None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw what is to do, the folded rest and the button that reads the whole scene."""
        layout = self.layout  # type: ignore[attr-defined]
        by_export = preflight.by_export()
        rows = preflight.rows()
        folded = [f for f in rows if f in by_export or (f.level == FINE and not f.fixes)]
        column = layout.column()
        for finding in rows:
            if finding not in folded:
                _draw_finding(column, context, finding)
        if folded:
            header, body = layout.panel("mfo_details", default_closed=True)
            header.label(text="What Was Checked")
            for finding in folded if body else ():
                _draw_finding(body, context, finding)
        layout.operator(
            "mfo.check",
            text="Check All Again" if preflight.is_thorough else "Check Everything",
            icon="VIEWZOOM",
        )


def _draw_finding(layout: bpy.types.UILayout, context: bpy.types.Context, finding: Finding) -> None:
    """A sentence and its buttons; what was mended keeps its place and its size, so that nothing moves."""
    is_mended = finding in preflight.mended
    column = layout.column(align=True)
    column.alert = finding.level == STOPS and not is_mended
    column.active = not is_mended
    draw_sentence(column, context, finding.sentence, "CHECKMARK" if is_mended else _ICONS[finding.level])
    if finding.fixes:
        buttons = layout.column(align=True)
        buttons.enabled = not is_mended
        for fix in finding.fixes:
            label = translated(KINDS[fix.kind].label.format(fix.argument))
            icon = "CHECKMARK" if is_mended else "TOOL_SETTINGS"
            button = buttons.operator("mfo.mend", text=label, icon=icon)
            button.kind, button.argument = fix.kind, fix.argument
            button.object, button.slot = fix.of or ("", 0)
