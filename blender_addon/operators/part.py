# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of the reference that counts: `mfo.draw_part`, `mfo.paint_mask` and `mfo.whole_picture`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy
from bpy.props import IntProperty

from ..check import preflight
from ..export.camera.render_region import pictured_size
from ..picture_part import count_all, count_render_region
from ..pictures import overlay
from ..sentences.translated import translated


class MFO_OT_show_part(bpy.types.Operator):
    """Look through the camera, with the reference over the view"""

    bl_idname = "mfo.show_part"
    bl_label = "Show the Reference"
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Turn the view; the overlay is for the eye only, so a picture that cannot be read is no reason to stop."""
        context.space_data.region_3d.view_perspective = "CAMERA"
        if not overlay.is_shown(context.scene.camera):
            try:
                overlay.show(context.scene)
            except RuntimeError as error:
                self.report({"WARNING"}, translated(str(error).strip()))
        return {"FINISHED"}


class MFO_OT_take_render_region(bpy.types.Operator):
    """Let the rectangle of the render region be the part of the reference that counts, and turn the region off"""

    bl_idname = "mfo.take_render_region"
    bl_label = "Only This Region Counts"
    bl_options = {"REGISTER", "UNDO"}

    # no poll: Blender asks that of every step before the first one, which draws the region

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Take the edges over."""
        if not context.scene.render.use_border:
            self.report({"WARNING"}, translated("There is no render region: draw one in the camera's view"))
            return {"CANCELLED"}
        count_render_region(context.scene)
        preflight.request()
        return {"FINISHED"}


class MFO_OT_draw_part(bpy.types.Macro):
    """Draw a rectangle over the camera's view: what lies outside has no part in the fit"""

    bl_idname = "mfo.draw_part"
    bl_label = "Draw What Counts"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only in a 3D view of a scene with a camera and a reference."""
        settings, camera = context.scene.mfo, context.scene.camera
        chosen = settings.reference_image if settings.reference_source == "IMAGE" else settings.reference_path
        if context.space_data is None or context.space_data.type != "VIEW_3D":
            cls.poll_message_set(translated("Draw in a 3D view: open the sidebar there"))
            return False
        render = context.scene.render
        if render.use_border and render.use_crop_to_border:
            cls.poll_message_set(
                translated("Render Region cuts the picture already: turn it off, or give the edges below")
            )
            return False
        if camera is None or camera.type != "CAMERA" or not chosen:
            cls.poll_message_set(translated("Choose the picture to match, and give the scene a camera, first"))
            return False
        return True


class MFO_OT_paint_mask(bpy.types.Operator):
    """Make a white mask of the picture's size and open it for painting: paint black what does not count"""

    bl_idname = "mfo.paint_mask"
    bl_label = "Paint a Mask"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make the image, or take the chosen one, and show it in an Image Editor where one is open."""
        part = context.scene.mfo.first_picture.part
        if part.mask is None:
            part.mask = bpy.data.images.new("Mask", *pictured_size(context.scene.render))
            part.mask.generated_color = (1.0, 1.0, 1.0, 1.0)
            part.mask.use_fake_user = True  # it may have no other user while the scene's settings change
        editors = [a.spaces.active for a in context.screen.areas if a.type == "IMAGE_EDITOR"] if context.screen else []
        for editor in editors[:1]:
            editor.image, editor.ui_mode = part.mask, "PAINT"
        if not editors:
            self.report({"INFO"}, translated(f"The mask {part.mask.name!r} is ready: paint it in an Image Editor."))
        preflight.request()
        return {"FINISHED"}


class MFO_OT_whole_picture(bpy.types.Operator):
    """Let all of the picture count again; a painted mask stays in the file"""

    bl_idname = "mfo.whole_picture"
    bl_label = "Whole Picture"
    bl_options = {"REGISTER", "UNDO"}

    number: IntProperty(
        name="Number", description="Of several pictures, from 1", default=1, min=1, options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Put every setting of the part back."""
        settings = context.scene.mfo
        pictures = (settings.first_picture, *settings.pictures)
        if self.number > len(pictures):
            self.report({"ERROR"}, translated(f"There is no picture {self.number}: the last is {len(pictures)}."))
            return {"CANCELLED"}
        count_all(pictures[self.number - 1].part)
        preflight.request()
        return {"FINISHED"}


def define_steps() -> None:
    """Tell Blender what the macro does; it must be registered."""
    for name in ("MFO_OT_show_part", "VIEW3D_OT_render_border", "MFO_OT_take_render_region"):
        MFO_OT_draw_part.define(name)


CLASSES = (
    MFO_OT_show_part,
    MFO_OT_take_render_region,
    MFO_OT_draw_part,
    MFO_OT_paint_mask,
    MFO_OT_whole_picture,
)
