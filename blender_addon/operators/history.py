# SPDX-License-Identifier: GPL-3.0-or-later
"""The history of a material: record a result, apply, show or remove an earlier one, open a job folder from disk."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ..check import preflight
from ..result import history, shown_result
from ..result.job_result import JobResult, JobResultError, must_ask, read_job_result, result_folders
from ..result.local_copy import unwritable
from ..result.write_back import WriteBackError, apply_values
from ..running import kept_results, running_job
from ..sentences.translated import translated
from .apply import PRESS_AGAIN, was_asked

_SCRIPT = {"HIDDEN", "SKIP_SAVE"}
_MISMATCH = "This result did not match its reference."


class MFO_OT_record_results(bpy.types.Operator):
    """Put new results into the histories of their materials"""

    bl_idname = "mfo.record_results"
    bl_label = "Record Fit Result"
    bl_options = {"UNDO", "INTERNAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Record what waits."""
        return {"FINISHED"} if running_job.record_results() else {"CANCELLED"}


class _PastResult:
    """Works on the result that is marked in the history of the active material."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a marked result."""
        if history.chosen(_material(context)) is None:
            cls.poll_message_set(translated("The active material has no earlier results"))  # type: ignore[attr-defined]
            return False
        return True


class MFO_OT_apply_past(_PastResult, bpy.types.Operator):
    """Put the values of the marked result on the material; sockets with a link stay as they are"""

    bl_idname = "mfo.apply_past"
    bl_label = "Apply Earlier Result"
    bl_options = {"REGISTER", "UNDO"}

    force: BoolProperty(name="Force", description="Also a result that does not match its reference", options=_SCRIPT)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """By a button: a result that does not match is applied at the second press."""
        entry = history.chosen(_material(context))
        if entry is not None and must_ask(entry.verdict):
            if not was_asked(context, entry.job_folder):
                self.report({"WARNING"}, translated(f"{_MISMATCH} {PRESS_AGAIN}"))
                return {"CANCELLED"}
            self.force = True
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the sockets from the values in the .blend; the job folder may be gone."""
        material = _material(context)
        entry = history.chosen(material)
        assert material is not None
        assert entry is not None  # see poll
        if must_ask(entry.verdict) and not self.force:
            self.report({"ERROR"}, translated(f"{_MISMATCH} Nothing was applied; force=True applies it anyway."))
            return {"CANCELLED"}
        try:
            notes = apply_values(
                material,
                history.values_of(entry),
                Path(entry.job_folder),
                animated=context.scene.mfo.animated,
                leaf=entry.leaf or None,
            )
        except WriteBackError as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        for note in notes:
            self.report({"WARNING"}, translated(note))
        return {"FINISHED"}


class MFO_OT_show_past(_PastResult, bpy.types.Operator):
    """Show pictures and numbers of the marked result in the panel"""

    bl_idname = "mfo.show_past"
    bl_label = "Show Earlier Result"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Not while a fit uses the panel."""
        if running_job.current is not None:
            cls.poll_message_set(translated("A fit is running; its pictures are shown"))
            return False
        return super().poll(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Read its job folder."""
        material = _material(context)
        entry = history.chosen(material)
        assert material is not None
        assert entry is not None
        try:
            _show([(read_job_result(Path(entry.job_folder)), material.session_uid)])
        except (JobResultError, WriteBackError) as error:
            self.report({"ERROR"}, translated(f"{error} Its values are kept here and can be applied."))
            return {"CANCELLED"}
        return {"FINISHED"}


class MFO_OT_remove_past(_PastResult, bpy.types.Operator):
    """Remove the marked result from the history; its job folder stays"""

    bl_idname = "mfo.remove_past"
    bl_label = "Remove Earlier Result"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove it and mark the one before."""
        material = _material(context)
        assert material is not None
        kept = material.mfo
        kept_results.forget(Path(kept.history[kept.history_index].job_folder))
        kept.history.remove(kept.history_index)
        kept.history_index = max(0, min(kept.history_index, len(kept.history) - 1))
        return {"FINISHED"}


class MFO_OT_open_job(bpy.types.Operator):
    """Open the folder of a finished fit: show it here and add it to the history of its material"""

    bl_idname = "mfo.open_job"
    bl_label = "Load Result"
    bl_options = {"REGISTER", "UNDO"}

    directory: StringProperty(name="Job Folder", subtype="DIR_PATH", options=_SCRIPT)
    material: StringProperty(name="Material", description="Empty: the one that was fitted", options=_SCRIPT)

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Not while a fit uses the panel."""
        if running_job.current is not None:
            cls.poll_message_set(translated("A fit is running; wait for it or cancel it"))
            return False
        return True

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Show its results; without its material in this file there is nothing to add one to."""
        try:
            found = [read_job_result(path) for path in result_folders(Path(bpy.path.abspath(self.directory)))]
            if len(found) > 1 and self.material:
                raise JobResultError("The job has several materials, and one is named: leave the name out.")
            materials = [bpy.data.materials.get(self.material or each.material_name) for each in found]
            _show([(each, m.session_uid if m else 0) for each, m in zip(found, materials, strict=True)])
            for each, material in zip(found, materials, strict=True):
                if material is not None and not unwritable(material):
                    history.record(material, each)
        except (JobResultError, WriteBackError) as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        for each, material in zip(found, materials, strict=True):
            if material is None:
                self.report({"WARNING"}, translated(f"Material {each.material_name!r} is not in this file."))
        return {"FINISHED"}


def _material(context: bpy.types.Context) -> bpy.types.Material | None:
    return context.object.active_material if context.object else None


def _show(found: list[tuple[JobResult, int]]) -> None:
    """Show results with their materials' session_uid; several were fitted together."""
    runtime = bpy.context.window_manager.mfo_runtime
    shown_result.clear(runtime)
    shown_result.show_all(found)
    runtime.state, runtime.sentence = "DONE", found[0][0].sentence
    preflight.redraw()


CLASSES = (MFO_OT_record_results, MFO_OT_apply_past, MFO_OT_show_past, MFO_OT_remove_past, MFO_OT_open_job)
