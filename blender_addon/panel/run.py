# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset, Fit and Cancel, progress with live pictures, the queue."""

from __future__ import annotations

import bpy

from ..backend.backend_section import draw_setup, has_trouble
from ..check import preflight
from ..operators.fit_options import selected_targets
from ..pictures import previews
from ..result import shown_result
from ..result.job_result import must_ask
from ..running import fit_queue, live, running_export, running_job
from ..sentences.translated import translated, word
from ..translations import CONTEXT
from .layout import BOX, BUTTON, LABEL, UNIT, draw_pictures, draw_sentence, fits, room

REFUSED = "The fit did not begin: the check above says what is to be mended."
_USUAL_SECONDS = 3.0  # of an export that asks Cycles something

_JOINT = " · "  # between what is done, how far it is and the time left


class Run:
    """Start, watch and stop a fit."""

    bl_label = "Fit"
    bl_translation_context = CONTEXT

    def draw(self, context: bpy.types.Context) -> None:
        """Draw settings and button, or the progress."""
        layout, settings = self.layout, context.scene.mfo  # type: ignore[attr-defined]  # from Panel
        live.watch(context)
        if running_job.current is not None:
            _draw_progress(layout, context)
        if running_export.current is not None:
            _draw_export(layout, context)
        _draw_buttons(layout, context)
        column = layout.column()
        column.use_property_split, column.use_property_decorate = True, False
        column.prop(settings, "preset")
        column.prop(settings, "live")
        header, body = column.panel("mfo_advanced", default_closed=True)
        header.label(text="Advanced")
        if body:
            body.prop(settings, "model")
            body.prop(settings, "range")
            body.prop(settings, "max_iterations")
        _draw_queue(layout, context)
        if has_trouble():
            draw_setup(layout, context, width=room(context) - BOX - LABEL)
        _draw_end(layout, context)  # a result of an earlier day needs no backend


def _draw_end(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What the last fit came to: its verdict, or why it failed."""
    runtime = context.window_manager.mfo_runtime
    # of a file that was left, of results that came back, or of a fit that was cancelled early
    if runtime.state == "IDLE" and runtime.sentence:
        box = layout.box()
        draw_sentence(box, context, runtime.sentence, "INFO")
        if runtime.job_folder:
            box.operator_context = "EXEC_DEFAULT"  # without a question for the folder
            box.operator("mfo.open_job", text="Load Result", icon="FILE_FOLDER").directory = runtime.job_folder
    if running_job.current is not None and runtime.sentence:  # why another one could not begin
        box = layout.box()
        box.alert = True
        draw_sentence(box, context, runtime.sentence, "ERROR")
    if runtime.state not in {"DONE", "FAILED"} or running_job.is_answered(context):
        return
    failed = runtime.state == "FAILED"
    box = layout.box()
    box.alert = failed or must_ask(runtime.verdict)
    icon = "ERROR" if failed else shown_result.VERDICT_ICONS.get(runtime.verdict, "INFO")
    is_listed = failed and preflight.lists(runtime.sentence)
    draw_sentence(box, context, REFUSED if is_listed else runtime.sentence, icon)
    for message in runtime.messages if failed else ():
        if message.icon == "ERROR":  # the others are notes of the export
            draw_sentence(box, context, message.name, message.icon)


def _draw_buttons(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    running = running_job.current is not None
    column = layout.column(align=True)
    row = column.row(align=True)
    row.scale_y = 1.0 if running else 1.4
    several = bool(context.scene.mfo.targets)
    row.enabled = not preflight.refusal(context)  # the tooltip says why, and a script may give what is missing
    row.operator(
        "mfo.fit",
        text="Add to Queue" if running else "Fit Together" if several else "Fit Material",
        icon="ADD" if running else "PLAY",
    )
    if not several and len(selected_targets(context, most=2)) > 1:
        row = column.row(align=True)
        row.enabled = not preflight.refusal(context, of_all=True)
        row.operator("mfo.fit_selected", icon="OUTLINER_OB_GROUP_INSTANCE")


def _draw_export(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """What is waited for, how long already, and the way out."""
    seconds, (share, text) = running_export.seconds(), running_export.progress()
    if share is None:
        share = seconds / (seconds + _USUAL_SECONDS)  # how long it takes is not known
    said = translated(text) if text else word("Cycles prepares the scene")
    _draw_bar(layout, context, share, f"{said} · {seconds:.0f} s")


def _draw_bar(
    layout: bpy.types.UILayout, context: bpy.types.Context, share: float, text: str, *, fit_alone: bool = False
) -> None:
    """How far it is, and the way out; what is done stands below where it would cost the time left its room."""
    done, joint, rest = text.partition(_JOINT)
    fitting = not joint or fits(context, room(context) - UNIT - BUTTON, text)
    row = layout.row(align=True)
    row.scale_y = 1.4
    row.progress(factor=share, type="BAR", text=text if fitting else rest)
    row.operator("mfo.cancel", text="", icon="X").fit_alone = fit_alone
    if not fitting:
        layout.label(text=done, translate=False)


def _draw_progress(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    runtime = context.window_manager.mfo_runtime
    column = layout.column()
    _draw_bar(column, context, runtime.fraction, translated(runtime.progress_text), fit_alone=True)
    own = context.object.active_material if context.object else None
    uids = running_job.current.fit.uids if running_job.current is not None else ()
    fitted = shown_result.material_of(uids[0]) if len(uids) == 1 else None
    if fitted is not None and fitted != own:
        draw_sentence(column, context, f"Of material {fitted.name}", "MATERIAL")
    shown = tuple(name for name in ("reference", "current", "difference") if previews.icon(name))
    if "current" not in shown:
        return
    has_choice = "difference" in shown and previews.pair("reference", "current") is not None  # two share a square
    draw_pictures(column, context, ("difference", "current") if has_choice and runtime.shows_difference else shown)
    if has_choice:
        column.prop(runtime, "shows_difference", toggle=True)


def _draw_queue(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    if not fit_queue.waiting and not fit_queue.finished:
        return
    box = layout.box()
    said = f"Queue: {len(fit_queue.waiting)} waiting, {len(fit_queue.finished)} ended"
    draw_sentence(box, context, said, "SEQUENCE")
    for ended in fit_queue.finished:
        draw_sentence(box, context, f"{ended.material_name}: {ended.sentence}", ended.icon)
    for index, fit in enumerate(fit_queue.waiting):
        row = box.row(align=True)
        row.label(text=fit.material_name, icon="TIME")
        row.operator("mfo.drop_queued", text="", icon="X").index = index
