# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.fit`, `mfo.cancel` and `mfo.check`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import shutil
from pathlib import Path

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from .. import running_job
from ..backend_python import BackendPythonError
from ..export.job import ExportError, check_export, export_job
from ..job_process import JobProcess
from ..preferences import chosen_python, new_job_folder
from ..properties import chosen_of
from ..write_back import WriteBackError, principled_node

# what a script gives; buttons start with the defaults every time and the redo panel does not show them
_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


class FitError(Exception):
    """The fit cannot start; the message is one sentence for the user."""


class MFO_OT_fit(bpy.types.Operator):
    """Recover the values of the object's active material from the reference picture"""

    bl_idname = "mfo.fit"
    bl_label = "Fit Material"
    bl_options = {"REGISTER"}

    object: StringProperty(name="Object", description="Name of the object; empty: the active one", options=_SCRIPT)
    reference: StringProperty(
        name="Reference", description="Picture to reproduce; empty: the scene's setting", options=_SCRIPT
    )
    preset: StringProperty(name="Preset", description="How to search; empty: the scene's setting", options=_SCRIPT)
    parameters: StringProperty(
        name="Parameters",
        description='"all", "reduced" or names with commas; empty: the scene\'s setting',
        options=_SCRIPT,
    )
    model: StringProperty(name="Model", description="Material model; empty: the scene's setting", options=_SCRIPT)
    job_folder: StringProperty(name="Job Folder", description="Folder for the job; empty: a new one", options=_SCRIPT)
    range: StringProperty(
        name="Range", description='"hdr", "ldr" or "auto"; empty: the scene\'s setting', options=_SCRIPT
    )
    max_iterations: IntProperty(
        name="Iterations", description="Most iterations of a stage; 0: the scene's setting", min=0, options=_SCRIPT
    )
    bake_view: BoolProperty(
        name="Bake View", description="Take a display picture under any view; off: the scene's setting", options=_SCRIPT
    )
    wait: BoolProperty(
        name="Wait", description="Return when the fit has ended; always so by default in background", options=_SCRIPT
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Refused while a fit runs; anything else is said by name when it starts."""
        if running_job.current is not None:
            cls.poll_message_set("A fit is running; cancel it first")
            return False
        if not bpy.app.background and context.object is None:
            cls.poll_message_set("Select the object whose material is to be fitted")
            return False
        if not bpy.app.background and context.object.active_material is None:
            cls.poll_message_set("The object has no material in its active slot; give it one with a Principled BSDF")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Export the job and start the backend; wait for it in background mode."""
        try:
            self._start(context)
        except FitError as error:
            running_job.fail([str(error)])
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not self._blocks():
            return {"FINISHED"}
        outcome = running_job.wait(lambda line: print(f"Material Fit: {line}", flush=True))
        runtime = context.window_manager.mfo_runtime
        if runtime.state == "FAILED":
            self.report({"ERROR"}, runtime.sentence)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{outcome.sentence} {_error_summary()}".strip())
        return {"FINISHED"}

    def _blocks(self) -> bool:
        return self.wait or (bpy.app.background and not self.properties.is_property_set("wait"))

    def _start(self, context: bpy.types.Context) -> None:
        settings = context.scene.mfo
        obj = _target(context, self.object)
        material = _active_material(obj)
        reference = _reference(settings, self.reference)
        try:
            python = chosen_python(context)
        except BackendPythonError as error:
            raise FitError(str(error)) from error
        given = bpy.path.abspath(self.job_folder)
        folder = Path(given) if given else new_job_folder(context, material.name)
        is_new = not folder.exists()
        try:
            bake_view = self.bake_view or settings.bake_view
            report = export_job(context, obj, folder, reference=reference, fit=self._fit(settings), bake_view=bake_view)
        except ExportError as error:
            raise FitError(str(error)) from error
        try:
            process = JobProcess(python, report.folder)
        except OSError as error:
            if is_new:
                shutil.rmtree(folder, ignore_errors=True)
            raise FitError(
                f"The backend could not be started with {python} in {folder} ({error.strerror or error})."
            ) from error
        timer = not self._blocks() and not bpy.app.background
        reference_copy = folder / report.request["reference"]["path"]
        running_job.start(process, material, reference_copy, report.notes, is_new=is_new, timer=timer)

    def _fit(self, settings: bpy.types.PropertyGroup) -> dict[str, object]:
        model = self.model or settings.model
        parameters: object = self.parameters or settings.parameter_set
        if parameters == "chosen":
            parameters = ",".join(_chosen(settings, model))
            if not parameters:
                raise FitError("No parameter is chosen: choose at least one, or All.")
        if parameters not in ("all", "reduced"):
            parameters = [name.strip() for name in str(parameters).split(",") if name.strip()]
            if not parameters:
                raise FitError(f"parameters is {self.parameters!r}: give 'all', 'reduced' or names with commas.")
        fit = {
            "model": model,
            "preset": self.preset or settings.preset,
            "parameters": parameters,
            "max_iterations": self.max_iterations or settings.max_iterations,
        }
        compared = self.range or settings.range
        if compared not in ("auto", "hdr", "ldr"):
            raise FitError(f"range is {compared!r}: give 'hdr', 'ldr' or 'auto'.")
        return fit if compared == "auto" else fit | {"range": compared}


class MFO_OT_cancel(bpy.types.Operator):
    """Stop the running fit and keep the best values found so far"""

    bl_idname = "mfo.cancel"
    bl_label = "Cancel Fit"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Only while a fit runs and was not cancelled yet."""
        if running_job.current is None:
            cls.poll_message_set("No fit is running")
            return False
        if running_job.current.process.cancelling:
            cls.poll_message_set("The fit is being cancelled")
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Ask the backend to stop; the timer sees it end."""
        running_job.cancel()
        return {"FINISHED"}


class MFO_OT_check(bpy.types.Operator):
    """List what will be left out of the export and what stops a fit"""

    bl_idname = "mfo.check"
    bl_label = "Check"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Needs an object and no running fit."""
        return MFO_OT_fit.poll.__func__(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Fill the panel's list of messages."""
        try:
            errors, notes = check_export(context, _target(context, ""))
        except FitError as error:
            errors, notes = [str(error)], []
        runtime = context.window_manager.mfo_runtime
        runtime.messages.clear()
        runtime.checked = True
        for sentence in errors:
            running_job.add_message(runtime, sentence, "ERROR")
        for sentence in notes:
            running_job.add_message(runtime, sentence, "INFO")
        if not errors and not notes:
            running_job.add_message(runtime, "Everything can be exported.", "CHECKMARK")
        if runtime.state == "FAILED":
            runtime.state, runtime.sentence = "IDLE", ""
        running_job.redraw()
        return {"FINISHED"}


def _target(context: bpy.types.Context, name: str) -> bpy.types.Object:
    if name:
        obj = context.scene.objects.get(name)
        if obj is None:
            raise FitError(
                f"The scene {context.scene.name!r} has no object {name!r}: give the name of one of its objects."
            )
        return obj
    obj = context.view_layer.objects.active
    if obj is None:
        raise FitError("No object is active: select the object whose material is to be fitted, or give its name.")
    return obj


def _active_material(obj: bpy.types.Object) -> bpy.types.Material:
    material = obj.active_material
    if material is None:
        raise FitError(f"Object {obj.name!r} has no material in its active slot: give it one with a Principled BSDF.")
    try:
        principled_node(material)
    except WriteBackError as error:
        raise FitError(str(error)) from error
    return material


def _reference(settings: bpy.types.PropertyGroup, given: str) -> Path | bpy.types.Image:
    if not given and settings.reference_source == "IMAGE":
        if settings.reference_image is None:
            raise FitError("No reference is chosen: choose an image of this file, or a picture on disk.")
        return settings.reference_image
    path = given or settings.reference_path
    if not path:
        raise FitError("No reference is chosen: give the picture whose material is to be recovered.")
    return Path(bpy.path.abspath(path))


def _chosen(settings: bpy.types.PropertyGroup, model: str) -> list[str]:
    """The chosen parameters of a model in the order of its list; the property itself is a set."""
    name = chosen_of(model)
    items = settings.bl_rna.properties[name].enum_items
    return [item.identifier for item in items if item.identifier in getattr(settings, name)]


def _error_summary() -> str:
    found = running_job.result
    return "; ".join(f"{name} {a:.4g} to {b:.4g}" for name, (a, b) in found.errors.items()) if found else ""


CLASSES = (MFO_OT_fit, MFO_OT_cancel, MFO_OT_check)
