# SPDX-License-Identifier: GPL-3.0-or-later
"""Several materials at once: `mfo.list_materials`, `mfo.clear_materials` and `mfo.show_material`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy
from bpy.props import IntProperty

from ..export.scene.seen_slots import seen_slots
from ..result import shown_result
from ..running import running_job
from ..sentences.translated import translated


def _views(scene: bpy.types.Scene) -> list[tuple[bpy.types.Object, int]]:
    """Camera and frame of each listed picture of the scene that is used; none where there is no list."""
    settings = scene.mfo
    if not settings.pictures:
        return []
    used = [each for each in (settings.first_picture, *settings.pictures) if each.use and each.scene in (None, scene)]
    cameras = [(each.camera or scene.camera, each.frame) for each in used]
    return list(dict.fromkeys((camera, frame) for camera, frame in cameras if camera is not None))


class MFO_OT_list_materials(bpy.types.Operator):
    """List the materials that the cameras of the pictures see, to fit several of them together"""

    bl_idname = "mfo.list_materials"
    bl_label = "Fit Several Materials"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make the list anew; what was unticked stays so."""
        entries = context.scene.mfo.targets
        slots = seen_slots(context, _views(context.scene))
        if not slots:
            self.report(
                {"ERROR"}, translated("The camera sees no material with a Principled BSDF: set the scene's camera up.")
            )
            return {"CANCELLED"}
        off = {entry.material for entry in entries if not entry.use}
        entries.clear()
        for each in slots:
            entry = entries.add()
            entry.object, entry.slot, entry.material = each.object, each.slot, each.material
            entry.use = each.material not in off
        running_job.redraw()
        return {"FINISHED"}


class MFO_OT_clear_materials(bpy.types.Operator):
    """Fit the material of the active object alone again"""

    bl_idname = "mfo.clear_materials"
    bl_label = "Fit One Material"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Empty the list."""
        context.scene.mfo.targets.clear()
        running_job.redraw()
        return {"FINISHED"}


class MFO_OT_show_material(bpy.types.Operator):
    """Show the values and pictures of this one of the materials that were fitted together"""

    bl_idname = "mfo.show_material"
    bl_label = "Show Result of Material"
    bl_options = {"REGISTER", "INTERNAL"}

    index: IntProperty(options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Show it; the others stay to be applied with it."""
        if not 0 <= self.index < len(shown_result.together):
            self.report({"ERROR"}, translated("There is no such result any more: run the fit again."))
            return {"CANCELLED"}
        shown_result.show_one(self.index)
        running_job.redraw()
        return {"FINISHED"}


CLASSES = (MFO_OT_list_materials, MFO_OT_clear_materials, MFO_OT_show_material)
