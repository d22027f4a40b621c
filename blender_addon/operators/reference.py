# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.use_reference`, also by dropping a picture onto the panel, and `mfo.overlay_reference`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy
from bpy.props import IntProperty, StringProperty

from ..check import preflight
from ..export.reference.chosen_file import DISPLAY_SUFFIXES, LINEAR_SUFFIXES
from ..pictures import overlay
from ..sentences.translated import translated


class MFO_OT_use_reference(bpy.types.Operator):
    """Make this picture the reference"""

    bl_idname = "mfo.use_reference"
    bl_label = "Match This Picture (Material Fit)"
    bl_options = {"UNDO", "INTERNAL"}

    filepath: StringProperty(subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})
    number: IntProperty(
        name="Number", description="Which of several pictures, from 1", default=1, options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the path in the scene's settings; an overlay shows the new picture."""
        scene = context.scene
        if self.number > 1:
            return self._use_further(scene)
        scene.mfo.reference_source, scene.mfo.reference_path = "FILE", self.filepath
        if overlay.is_shown(scene.camera):
            try:
                overlay.show(scene)
            except RuntimeError as error:
                self.report({"WARNING"}, translated(str(error).strip()))
        preflight.request()
        return {"FINISHED"}

    def _use_further(self, scene: bpy.types.Scene) -> set[str]:
        pictures = scene.mfo.pictures
        if self.number > 1 + len(pictures):
            self.report({"ERROR"}, translated(f"There is no picture {self.number}: the last is {1 + len(pictures)}."))
            return {"CANCELLED"}
        pictures[self.number - 2].path = self.filepath
        preflight.request()
        return {"FINISHED"}


class MFO_OT_overlay_reference(bpy.types.Operator):
    """Show the reference over the camera's view, or take it away"""

    bl_idname = "mfo.overlay_reference"
    bl_label = "Reference over the View"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a camera and a reference."""
        settings, camera = context.scene.mfo, context.scene.camera
        chosen = settings.reference_image if settings.reference_source == "IMAGE" else settings.reference_path
        if camera is None or camera.type != "CAMERA":
            cls.poll_message_set(translated("The scene has no camera; add one"))
            return False
        if not chosen and not overlay.is_shown(camera):
            cls.poll_message_set(translated("Choose the picture to match first"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Switch it, and look through the camera when it comes."""
        scene = context.scene
        if overlay.is_shown(scene.camera):
            overlay.hide(scene.camera)
            return {"FINISHED"}
        try:
            overlay.show(scene)
        except RuntimeError as error:
            self.report(
                {"ERROR"}, translated(f"The reference cannot be shown ({str(error).strip()}): choose another file.")
            )
            return {"CANCELLED"}
        view = getattr(context.space_data, "region_3d", None)
        if view is not None:
            view.view_perspective = "CAMERA"
        return {"FINISHED"}


class MFO_FH_reference(bpy.types.FileHandler):
    """A picture that is dropped onto the panel becomes the reference."""

    bl_idname = "MFO_FH_reference"
    bl_label = "Use as Reference of Material Fit"
    bl_import_operator = "mfo.use_reference"
    bl_file_extensions = ";".join(LINEAR_SUFFIXES + DISPLAY_SUFFIXES)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Over the panels, and over a 3D view that shows them, where Blender asks what the picture is for."""
        area, region = context.area, context.region
        if area is None or region is None:
            return False
        if (area.type, region.type) == ("VIEW_3D", "WINDOW"):
            return any(getattr(each, "active_panel_category", "") == "Material Fit" for each in area.regions)
        return (area.type, region.type) in {("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW")}


CLASSES = (MFO_OT_use_reference, MFO_OT_overlay_reference, MFO_FH_reference)
