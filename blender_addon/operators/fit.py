# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.fit`, `mfo.fit_selected`, `mfo.drop_queued` and `mfo.cancel`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ..backend.backend_section import why_no_fit
from ..backend.preferences import idle_seconds
from ..check import preflight
from ..check.checks import quick_check
from ..check.finding import first_refused
from ..check.ticked_slots import NONE_TICKED, left_out, ticked_slots
from ..export.fitted_slot import FittedSlot
from ..export.meshes.known_meshes import KnownMeshes
from ..export.steps import Pause, Steps, drained, part_of
from ..process import waiting_backend
from ..process.own_blender import SERVER, own_blender
from ..result import shown_result
from ..running import fit_queue, running_export, running_job
from ..running.fit_queue import EndedFit, PreparedFit
from ..sentences.translated import translated
from .check import thorough_check
from .fit_options import (
    FitError,
    FitOptions,
    choose_shader,
    python_of,
    selected_targets,
    start_or_queue,
    target_of,
)

EXPORTING = "Object {} of {}"
RUNS_ALREADY = "Its fit runs already: press Fit when it has ended, to fit it again."
# what a script gives; buttons start with the defaults every time and the redo panel does not show them
_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


def _why_none_begins() -> str:
    """Why no fit may begin now, whatever it is of; empty: one may."""
    if running_job.current is not None and bpy.app.background:
        return "A fit is running; cancel it first"
    if running_export.current is not None:
        return "The scene is being exported for a fit"
    return "" if bpy.app.background else why_no_fit()


class MFO_OT_fit(FitOptions, bpy.types.Operator):
    """Recover the values of the object's active material from the reference picture"""

    bl_idname = "mfo.fit"
    bl_label = "Fit Material"
    bl_options = {"REGISTER"}

    object: StringProperty(name="Object", description="Name of the object; empty: the active one", options=_SCRIPT)
    job_folder: StringProperty(name="Job Folder", description="Folder for the job; empty: a new one", options=_SCRIPT)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """In windows only with an object and a material; anything else is said by name when it starts."""
        if reason := _why_none_begins():
            cls.poll_message_set(translated(reason))
            return False
        by_active = not bpy.app.background and not context.scene.mfo.targets
        if by_active and context.object is None:
            cls.poll_message_set(translated("Select the object whose material is to be fitted"))
            return False
        if by_active and context.object and context.object.active_material is None:
            cls.poll_message_set(
                translated("The object has no material in its active slot; give it one with a Principled BSDF")
            )
            return False
        return True

    @classmethod
    def description(cls, context: bpy.types.Context, _properties: bpy.types.OperatorProperties) -> str:
        """Why it does not start as things are, else what it does."""
        return _tooltip(cls, preflight.refusal(context))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Export the job and start the backend or, while another fit runs, queue it; wait in background mode."""
        try:
            if not (self.object or self.is_given()):  # which the check knows nothing of
                _refuse(context)
            if not bpy.app.background:  # it loads while the job is exported
                waiting_backend.prepare(python_of(context), idle_seconds(context), own_blender(SERVER, []))
                steps = self.steps(context, *self._targets(context))
                if not self.blocks():
                    running_export.start(context, steps, start_or_queue)
                    return {"FINISHED"}
            fit = drained(self.steps(context, *self._targets(context)))
            if running_job.current is not None:
                fit_queue.add(fit)
                self.report({"INFO"}, translated(f"Material {fit.material_name!r} waits for the fit that runs."))
                running_job.redraw()
                return {"FINISHED"}
            self.start(fit)
        except FitError as error:
            if not bpy.app.background:
                thorough_check(context)  # lists everything that stops it, with buttons
            running_job.fail([str(error)])
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        if not self.blocks():
            return {"FINISHED"}
        outcome = running_job.wait(lambda line: print(f"Material Fit: {line}", flush=True))
        running_job.record_results()
        runtime = context.window_manager.mfo_runtime
        if runtime.state == "FAILED" or not runtime.has_result:
            self.report({"ERROR"}, translated(runtime.sentence))
            return {"CANCELLED"}
        self.report({"INFO"}, translated(f"{outcome.sentence} {_error_summary()}".strip()))
        return {"FINISHED"}

    def _targets(self, context: bpy.types.Context) -> tuple[bpy.types.Object, str, list[FittedSlot], list[str]]:
        """The object, the folder, the ticked slots where several are fitted together, and what is left out of them."""
        if self.object or not context.scene.mfo.targets:
            return target_of(context, self.object), self.job_folder, [], []
        slots, said = ticked_slots(context.scene), left_out(context.scene)
        if not slots:
            raise FitError(" ".join(said) or NONE_TICKED)
        obj = slots[0].object
        if len(slots) == 1 and obj.active_material_index == slots[0].slot:
            return obj, self.job_folder, [], said
        return obj, self.job_folder, slots, said


class MFO_OT_fit_selected(FitOptions, bpy.types.Operator):
    """Fit the active material of every selected object, one after the other"""

    bl_idname = "mfo.fit_selected"
    bl_label = "Fit Selected Objects"
    bl_options = {"REGISTER"}

    @classmethod
    def description(cls, context: bpy.types.Context, _properties: bpy.types.OperatorProperties) -> str:
        """Why none of them would start as things are, else what it does."""
        return _tooltip(cls, preflight.refusal(context, of_all=True))

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """In windows only with more than one material to fit."""
        if reason := _why_none_begins():
            cls.poll_message_set(translated(reason))
            return False
        if not bpy.app.background and len(selected_targets(context, most=2)) < 2:
            cls.poll_message_set(
                translated("Select several objects that have different materials with a Principled BSDF")
            )
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Export one job for each material; the first starts, the others wait, or in background mode all are done."""
        try:
            if not self.is_given():
                _refuse(context, of_all=True)
        except FitError as error:
            running_job.fail([str(error)])
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        asked: list[_Asked] = []
        refused: list[EndedFit] = []
        known = KnownMeshes()
        for obj in selected_targets(context):
            material = obj.active_material
            try:
                asked.append(_Asked(material.name, material.session_uid, self.steps(context, obj, "", known=known)))
            except FitError as error:
                refused.append(EndedFit(material.name, str(error), "ERROR"))
        again = sum(fit_queue.waits(each.uid) for each in asked)
        if again:
            self.report({"INFO"}, translated(f"Fits that waited and are prepared anew: {again}."))
        steps = _one_after_other(asked, self._start_and_wait if self.blocks() else start_or_queue, refused)
        if asked and not bpy.app.background and not self.blocks():  # the first loads while it is exported
            waiting_backend.prepare(python_of(context), idle_seconds(context), own_blender(SERVER, []))
            running_export.start(context, steps, partial(_say_refused, refused))
            return {"FINISHED"}
        drained(steps)
        for each in refused:
            self.report({"WARNING"}, translated(f"{each.material_name}: {each.sentence}"))
        running_job.redraw()
        return {"FINISHED"} if running_job.current or shown_result.result else {"CANCELLED"}

    def _start_and_wait(self, fit: PreparedFit) -> None:
        self.start(fit)
        running_job.wait(lambda line: print(f"Material Fit: {line}", flush=True))


class MFO_OT_drop_queued(bpy.types.Operator):
    """Take this fit out of the queue"""

    bl_idname = "mfo.drop_queued"
    bl_label = "Remove from Queue"
    bl_options = {"REGISTER", "INTERNAL"}

    index: IntProperty(options=_SCRIPT)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Drop it; its folder goes if it was made for it."""
        if not 0 <= self.index < len(fit_queue.waiting):
            self.report({"ERROR"}, translated("This fit does not wait any more."))
            return {"CANCELLED"}
        fit_queue.drop(self.index)
        running_job.redraw()
        return {"FINISHED"}


class MFO_OT_cancel(bpy.types.Operator):
    """Stop the running fit and keep the best values found so far"""

    bl_idname = "mfo.cancel"
    bl_label = "Cancel Fit"
    bl_options = {"REGISTER"}

    fit_alone: BoolProperty(
        name="Fit Alone",
        description="Let an export for another fit go on; without it that is what ends",
        options=_SCRIPT,
    )

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Only while a fit runs or is exported, and was not cancelled yet."""
        if running_export.current is not None:
            return True
        if running_job.current is None:
            cls.poll_message_set(translated("No fit is running"))
            return False
        if running_job.current.process.cancelling:
            cls.poll_message_set(translated("The fit is being cancelled"))
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Ask the backend to stop; the timer sees it end. An export ends at once."""
        if running_export.current is not None and not self.fit_alone:
            running_export.close()
        else:
            running_job.cancel()
        running_job.redraw()
        return {"FINISHED"}


class MFO_OT_choose_shader(bpy.types.Operator):
    """Fit this shader of the material's mix and hold the others"""

    bl_idname = "mfo.choose_shader"
    bl_label = "Choose Shader to Fit"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}  # of a button that knows the names

    shader: StringProperty(name="Shader", description="Its node, after the groups it lies in", options={"SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Keep the choice with the material."""
        try:
            material = target_of(context, "").active_material
            if material is None:
                raise FitError("The active object has no material in its active slot.")
            choose_shader(material, self.shader)
        except FitError as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        return {"FINISHED"}


@dataclass(frozen=True)
class _Asked:
    """A material by name and session_uid, and the export for it."""

    name: str
    uid: int
    steps: Steps[PreparedFit]


def _one_after_other(
    asked: Sequence[_Asked], start: Callable[[PreparedFit], None], refused: list[EndedFit]
) -> Steps[int]:
    """Export for each material and `start` its fit; returns how many, the others are in `refused`.

    A fit of the material that waits gives way, and beside one that runs there is no second.
    """
    count = 0
    for number, each in enumerate(asked):
        text = EXPORTING.format(number + 1, len(asked))
        try:
            if number:
                yield Pause(holds_scene=True, text=text, share=number / len(asked))
            if running_job.current is not None and running_job.current.fit.uids == (each.uid,):
                refused.append(EndedFit(each.name, RUNS_ALREADY, "INFO"))
                continue
            fit_queue.give_way(each.uid)
            start((yield from part_of(each.steps, number, len(asked), text)))
            count += 1
        except FitError as error:
            refused.append(EndedFit(each.name, str(error), "ERROR"))
    return count


def _say_refused(refused: Sequence[EndedFit], started: int) -> None:
    """Where any has started, among those of the queue that have ended."""
    if not started:
        running_job.fail([f"{each.material_name}: {each.sentence}" for each in refused])
        return
    for each in refused:
        fit_queue.refused(each)


def _tooltip(operator: type[bpy.types.Operator], why_not: str) -> str:
    """Why it does not start as things are, else what it does."""
    return translated(why_not) if why_not else bpy.app.translations.pgettext_tip(str(operator.__doc__))


def _refuse(context: bpy.types.Context, *, of_all: bool = False) -> None:
    """Raise `FitError` with the first line of the check that keeps a fit from starting, with `of_all` of any object."""
    said = first_refused(quick_check(context.scene, context.view_layer), of_all=of_all)
    if said:
        raise FitError(said)


def _error_summary() -> str:
    found = shown_result.result
    return "; ".join(f"{name} {a:.4g} to {b:.4g}" for name, (a, b) in found.errors.items()) if found else ""


CLASSES = (MFO_OT_choose_shader, MFO_OT_fit, MFO_OT_fit_selected, MFO_OT_drop_queued, MFO_OT_cancel)
