# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.apply`, `mfo.revert` and `mfo.toggle` (A/B), each one undo step."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ..check.preflight import redraw
from ..result import shown_result
from ..result.job_result import JobResult, JobResultError, must_ask, read_job_result, result_folders, whole_job
from ..result.local_copy import unwritable
from ..result.write_back import (
    WriteBackError,
    apply_values,
    fitted_shader,
    result_to_sockets,
    revert_values,
    toggle_values,
)
from ..running import running_job
from ..sentences.translated import translated

# what a script gives; buttons start with the defaults every time and the redo panel does not show them
_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


ON_NOTHING = "Material {!r} is on no object any more: give it to one, else it may not be saved."
PRESS_AGAIN = "Press Apply again to apply it anyway."


def _is_used(material: bpy.types.Material) -> bool:
    """Whether an object or nodes have it; what nothing uses is not written into the file."""
    owners = bpy.data.user_map(subset={material})[material]
    return any(owner.users and not isinstance(owner, bpy.types.Scene) for owner in owners)


def was_asked(context: bpy.types.Context, folder: str) -> bool:
    """Whether the user was told before that the result of this job does not match; from now on that is so."""
    runtime = context.window_manager.mfo_runtime
    before, runtime.asked = runtime.asked, folder
    redraw()  # the button says what a second press does
    return before == folder


class MFO_OT_apply(bpy.types.Operator):
    """Put the recovered values on the material; sockets with a link stay as they are"""

    bl_idname = "mfo.apply"
    bl_label = "Apply Values"
    bl_options = {"REGISTER", "UNDO"}

    job_folder: StringProperty(
        name="Job Folder", description="Folder of a finished job; empty: the last fit", options=_SCRIPT
    )
    material: StringProperty(
        name="Material", description="Material to change; empty: the one that was fitted", options=_SCRIPT
    )
    force: BoolProperty(name="Force", description="Also a result that does not match its reference", options=_SCRIPT)

    animated: StringProperty(
        name="Animated", description='"leave" or "replace"; empty: the scene\'s setting', options=_SCRIPT
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """In windows only with a result; a script may always try with a job folder."""
        if running_job.current is not None:
            cls.poll_message_set(translated("A fit is running; wait for it or cancel it"))
            return False
        if not bpy.app.background and not context.window_manager.mfo_runtime.has_result:
            cls.poll_message_set(translated("There is no result yet; run a fit"))
            return False
        fitted = shown_result.material()
        if fitted is not None and unwritable(fitted):
            cls.poll_message_set(translated(unwritable(fitted)))
            return False
        return True

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """By a button: a result that does not match is applied at the second press."""
        found = shown_result.result
        if not self.job_folder and len(shown_result.together) > 1:
            self.force = was_asked(context, str(whole_job(shown_result.together[0][0].folder)))
        elif not self.job_folder and found is not None and must_ask(found.verdict):
            if not was_asked(context, str(found.folder)):
                self.report({"WARNING"}, translated(f"{found.sentence} {PRESS_AGAIN}"))
                return {"CANCELLED"}
            self.force = True
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Find results and materials, set the sockets, report what was skipped."""
        try:
            found = self._results()
            left = [result for result, _ in found if must_ask(result.verdict) and not self.force]
            if len(left) == len(found):
                raise WriteBackError(f"{left[0].sentence} Nothing was applied; force=True applies it anyway.")
            taken = [(result, self._material(result, uid)) for result, uid in found if result not in left]
            notes = [note for result, material in taken for note in self._put(context, result, material)]
        except (JobResultError, WriteBackError) as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        for result in left:
            self.report(
                {"WARNING"}, translated(f"{result.material_name!r} was left as it is: {result.sentence} {PRESS_AGAIN}")
            )
        for note in notes:
            self.report({"WARNING"}, translated(note))
        self.report({"INFO"}, translated(f"The recovered values are on {', '.join(repr(m.name) for _, m in taken)}."))
        return {"FINISHED"}

    def _put(self, context: bpy.types.Context, result: JobResult, material: bpy.types.Material) -> list[str]:
        notes = apply_values(
            material,
            result_to_sockets(result),
            result.folder,
            animated=self.animated or context.scene.mfo.animated,
            leaf=result.leaf or None,
        )
        return notes if _is_used(material) else [*notes, ON_NOTHING.format(material.name)]

    def _results(self) -> list[tuple[JobResult, int]]:
        """The results with their materials' session_uid, 0 where that is not known; several were fitted together."""
        if self.job_folder:
            folders = result_folders(Path(bpy.path.abspath(self.job_folder)))
            if len(folders) > 1 and self.material:
                raise JobResultError("The job has several materials, and one is named: leave the name out.")
            return [(read_job_result(folder), 0) for folder in folders]
        if shown_result.result is None:
            raise JobResultError("There is no result yet: run a fit, or give the folder of a finished job.")
        return list(shown_result.together) or [(shown_result.result, shown_result.material_uid)]

    def _material(self, result: JobResult, uid: int) -> bpy.types.Material:
        name = self.material or result.material_name
        of_this_session = not self.material and uid
        found = shown_result.material_of(uid) if of_this_session else bpy.data.materials.get(name)
        if found is None:
            if self.material:
                raise WriteBackError(f"Material {name!r} is not in this file (any more): name the one to change.")
            raise WriteBackError(
                f"Material {name!r} is not in this file (any more): undo what removed it, or take the values with Copy."
            )
        return found


class _OnAppliedMaterial:
    """What Revert and Toggle share: the material to which values were applied, and what is said of it."""

    bl_options = {"REGISTER", "UNDO"}

    material: StringProperty(name="Material", description="Empty: the active object's", options=_SCRIPT)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """In windows only where values were applied."""
        material = context.object.active_material if context.object else None
        if not bpy.app.background and (material is None or not material.mfo.originals):
            cls.poll_message_set(translated("Nothing was applied to the active material"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the other values, report what was skipped."""
        try:
            notes = self._change(applied_material(context, self.material))
        except WriteBackError as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        for note in notes:
            self.report({"WARNING"}, translated(note))
        return {"FINISHED"}


class MFO_OT_revert(_OnAppliedMaterial, bpy.types.Operator):
    """Give the active material the values back that it had before Apply"""

    bl_idname = "mfo.revert"
    bl_label = "Revert Values"
    _change = staticmethod(revert_values)


class MFO_OT_toggle(_OnAppliedMaterial, bpy.types.Operator):
    """Switch the active material between its own values (A) and the recovered ones (B)"""

    bl_idname = "mfo.toggle"
    bl_label = "Toggle Own and Recovered Values"
    _change = staticmethod(toggle_values)


def applied_material(context: bpy.types.Context, name: str) -> bpy.types.Material:
    """The material of that name, or the active object's, to which values were applied and may be again."""
    active = context.object.active_material if context.object else None
    material = bpy.data.materials.get(name) if name else active
    if material is None:
        raise WriteBackError("There is no material to revert: select its object or give its name.")
    if not material.mfo.originals:
        raise WriteBackError(f"Nothing was applied to material {material.name!r}, so nothing can be reverted.")
    if unwritable(material):
        raise WriteBackError(unwritable(material))
    fitted_shader(material)
    return material


CLASSES = (MFO_OT_apply, MFO_OT_revert, MFO_OT_toggle)
