# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders in Cycles beside this Blender: `mfo.check_in_cycles`, `mfo.render_reference` and what belongs to them."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import json
from collections.abc import Sequence

import bpy
from bpy.props import IntProperty, StringProperty

from ..backend.preferences import new_job_folder
from ..check import preflight
from ..check.ticked_slots import ticked_slots
from ..export.fitted_slot import FittedSlot
from ..result import shown_result
from ..running import cycles_check
from ..sentences.translated import translated
from .fit_options import FitError, python_of

_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


def _can_render(cls: type, context: bpy.types.Context) -> bool:
    """One render at a time, of a scene with a camera, and of no mesh that is being edited."""
    reason = ""
    if cycles_check.is_running():
        reason = "Cycles is rendering already; wait for it or cancel it"
    elif context.scene.camera is None:
        reason = "The scene has no camera; add one"
    elif not bpy.app.background and context.mode != "OBJECT":
        reason = "Leave Edit Mode first: what is edited is not in the copy that is rendered"
    if reason:
        cls.poll_message_set(translated(reason))  # type: ignore[attr-defined]
    return not reason


class MFO_OT_check_in_cycles(bpy.types.Operator):
    """Render the shown result with Cycles and compare it with the reference; Blender stays usable meanwhile"""

    bl_idname = "mfo.check_in_cycles"
    bl_label = "Check in Cycles"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a result, and one render at a time."""
        if not context.window_manager.mfo_runtime.has_result or shown_result.result is None:
            cls.poll_message_set(translated("There is no result to render; run a fit or show an earlier result"))
            return False
        return _can_render(cls, context)

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
        return _can_render(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start it; wait for it in background mode."""
        return _render(self, context, 1, ())


class MFO_OT_render_picture(bpy.types.Operator):
    """Render this picture in Cycles with another material of the file in the place of the one that is fitted"""

    bl_idname = "mfo.render_picture"
    bl_label = "Render with Another Material"
    bl_options = {"REGISTER", "INTERNAL"}  # it needs a number

    index: IntProperty(name="Index", description="Counted from 0", min=0, options=_SCRIPT)
    material: StringProperty(name="Material", description="What the picture shows; it is only read")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """As a reference is rendered, of one material."""
        if not _can_render(cls, context):
            return False
        if _fitted(context) is None:
            cls.poll_message_set(translated("Choose the one object and material that is fitted"))
            return False
        return True

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the material."""
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        """The material, and what for."""
        self.layout.label(text="For tests: what a fit should find is known then")
        self.layout.prop_search(self, "material", bpy.data, "materials")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start it; wait for it in background mode."""
        pictures, fitted = context.scene.mfo.pictures, _fitted(context)
        assert fitted is not None  # as `poll` has seen
        shown, own = bpy.data.materials.get(self.material), fitted.material
        reason = ""
        if self.index >= len(pictures):
            reason = f"There is no picture {self.index + 2}: the last is {len(pictures) + 1}."
        elif shown is None:
            reason = "Choose the material that the picture is to show."
        elif shown == own:
            reason = f"Material '{shown.name}' is the one that is fitted: choose the one that it should become."
        elif not shown.users:
            reason = (
                f"Material '{shown.name}' is used nowhere, and no copy of the file holds it: give it a fake user (the "
                "shield beside its name)."
            )
        if reason:
            self.report({"ERROR"}, translated(reason))
            return {"CANCELLED"}
        entry = pictures[self.index]
        given = {"frame": entry.frame, "camera": entry.camera, "scene": entry.scene, "exposure": entry.exposure}
        setup = {name: getattr(value, "name", value) for name, value in given.items() if value is not None}
        target = {"object": fitted.object.name, "slot": fitted.slot + 1}
        words = ["--target", json.dumps(target), "--picture", json.dumps(setup), "--material", self.material]
        return _render(self, context, self.index + 2, words)


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


def _fitted(context: bpy.types.Context) -> FittedSlot | None:
    """The one slot whose material is fitted; None for several or none."""
    if context.scene.mfo.targets:
        ticked = ticked_slots(context.scene)
        return ticked[0] if len(ticked) == 1 else None
    slot = FittedSlot.active(context.object) if context.object is not None else None
    return slot if slot is not None and slot.material is not None else None


def _render(operator: bpy.types.Operator, context: bpy.types.Context, number: int, words: Sequence[str]) -> set[str]:
    """Start the render of a picture of the list, counted from 1; wait for it in background mode."""
    try:
        cycles_check.render_reference(new_job_folder(context, "reference") / "reference.exr", number, words)
    except OSError as error:
        operator.report({"ERROR"}, translated(str(error)))
        return {"CANCELLED"}
    return _wait_in_background(operator, context)


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
    MFO_OT_render_picture,
    MFO_OT_cancel_cycles,
)
