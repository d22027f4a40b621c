# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders in Cycles beside this Blender: `mfo.check_in_cycles`, `mfo.render_reference` and what belongs to them."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy

from ..backend.preferences import new_job_folder
from ..check import preflight
from ..result import shown_result
from ..running import cycles_check
from ..sentences.translated import translated
from .fit_options import FitError, python_of

_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


def _refuse_second(cls: type) -> bool:
    if cycles_check.is_running():
        cls.poll_message_set(translated("Cycles is rendering already; wait for it or cancel it"))  # type: ignore[attr-defined]
    return cycles_check.is_running()


class MFO_OT_check_in_cycles(bpy.types.Operator):
    """Render the shown result with Cycles and compare it with the reference; Blender stays usable meanwhile"""

    bl_idname = "mfo.check_in_cycles"
    bl_label = "Check in Cycles"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a result, and one render at a time."""
        if _refuse_second(cls):
            return False
        if not context.window_manager.mfo_runtime.has_result or shown_result.result is None:
            cls.poll_message_set(translated("There is no result to render; run a fit or show an earlier result"))
            return False
        if not bpy.app.background and context.mode != "OBJECT":
            cls.poll_message_set(
                translated("Leave Edit Mode first: what is edited is not in the copy that is rendered")
            )
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start it; wait for it in background mode."""
        result, material = shown_result.result, shown_result.material()
        assert result is not None
        try:
            name = material.name if material else result.material_name
            cycles_check.check_result(result.folder, name, python_of(context))
        except (FitError, OSError) as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        return _wait_in_background(self, context)


class MFO_OT_render_reference(bpy.types.Operator):
    """Render the scene as it is now with Cycles into an EXR and make it the reference"""

    bl_idname = "mfo.render_reference"
    bl_label = "Render Reference"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a camera, and one render at a time."""
        if _refuse_second(cls):
            return False
        if context.scene.camera is None:
            cls.poll_message_set(translated("The scene has no camera; add one"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start it; wait for it in background mode."""
        try:
            cycles_check.render_reference(new_job_folder(context, "reference") / "reference.exr")
        except OSError as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        return _wait_in_background(self, context)


class MFO_OT_cancel_cycles(bpy.types.Operator):
    """Stop the render in Cycles"""

    bl_idname = "mfo.cancel_cycles"
    bl_label = "Cancel Render in Cycles"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Only while it runs."""
        if not cycles_check.is_running():
            cls.poll_message_set(translated("Cycles is not rendering for Material Fit"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Kill it; nothing of it is kept."""
        cycles_check.close()
        context.window_manager.mfo_runtime.cycles_text = ""
        preflight.redraw()
        return {"FINISHED"}


def _wait_in_background(operator: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
    if bpy.app.background:
        cycles_check.wait()
        runtime = context.window_manager.mfo_runtime
        if runtime.cycles_flip < 0.0 and runtime.cycles_text:
            operator.report({"ERROR"}, translated(runtime.cycles_text))
            return {"CANCELLED"}
    return {"FINISHED"}


CLASSES = (
    MFO_OT_check_in_cycles,
    MFO_OT_render_reference,
    MFO_OT_cancel_cycles,
)
