# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.check`, the buttons that mend what it finds, and the limits of values."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from contextlib import suppress

import bpy
from bpy.props import IntProperty, StringProperty

from ..check import preflight
from ..check.checks import from_export, in_order, quick_check
from ..check.mending import KINDS, MendingError, Place
from ..check.ticked_slots import ticked_slots
from ..export.job import ExportError, export_findings
from ..properties import toggle_bound, toggle_node_value
from ..running import running_job
from ..sentences.translated import translated

_BUTTON = {"HIDDEN", "SKIP_SAVE"}


class MFO_OT_check(bpy.types.Operator):
    """List what will be left out and what stops a fit, with everything an export would say"""

    bl_idname = "mfo.check"
    bl_label = "Check Everything"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Needs an object, or a list of materials."""
        if context.scene.mfo.targets:
            return True
        if not bpy.app.background and context.view_layer.objects.active is None:
            cls.poll_message_set(translated("Select the object whose material is to be fitted"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Read the whole scene as an export does, without writing anything."""
        thorough_check(context)
        runtime = context.window_manager.mfo_runtime
        if runtime.state == "FAILED":
            runtime.state, runtime.sentence = "IDLE", ""
        running_job.redraw()
        return {"FINISHED"}


class MFO_OT_mend(bpy.types.Operator):
    """Mend what a check has found"""

    bl_idname = "mfo.mend"
    bl_label = "Mend"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    kind: StringProperty(options=_BUTTON)
    argument: StringProperty(options=_BUTTON)
    object: StringProperty(options=_BUTTON)
    slot: IntProperty(options=_BUTTON)

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        """The tooltip of the button's own kind."""
        kind = KINDS.get(properties.kind)
        return translated(kind.tooltip) if kind else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the one thing and check again."""
        kind = KINDS.get(self.kind)
        try:
            if kind is None:
                raise MendingError(f"There is no remedy {self.kind!r}: give one of {', '.join(KINDS)}.")
            kind.mend(Place(context, (self.object, self.slot) if self.object else None), self.argument)
        except (MendingError, RuntimeError) as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        preflight.check_mended(context.scene, context.view_layer)
        running_job.redraw()
        return {"FINISHED"}


class MFO_OT_limit_value(bpy.types.Operator):
    """Give this value limits that the fit keeps, or take them away"""

    bl_idname = "mfo.limit_value"
    bl_label = "Limit Value"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    name: StringProperty(options=_BUTTON)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Switch the limits."""
        toggle_bound(context.scene.mfo, self.name)
        return {"FINISHED"}


class MFO_OT_choose_node_value(bpy.types.Operator):
    """Let the fit change this value of a node, or leave it as it is"""

    bl_idname = "mfo.choose_node_value"
    bl_label = "Choose Value of Node"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    name: StringProperty(options=_BUTTON)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Switch the choice."""
        toggle_node_value(context.scene.mfo, self.name)
        return {"FINISHED"}


def thorough_check(context: bpy.types.Context) -> None:
    """Make the quick check and add what an export would say."""
    scene, view_layer = context.scene, context.view_layer
    preflight.check_now(scene, view_layer)
    found = list(quick_check(scene, view_layer))
    targets = ticked_slots(scene) if scene.mfo.targets else []
    target = targets[0].object if targets else None if scene.mfo.targets else view_layer.objects.active
    if target is not None:
        with suppress(ExportError):  # the quick check names it
            found += from_export(export_findings(context, target, scene.mfo.model, targets))
    preflight.show_thorough(in_order(found))


CLASSES = (MFO_OT_check, MFO_OT_mend, MFO_OT_limit_value, MFO_OT_choose_node_value)
