# SPDX-License-Identifier: GPL-3.0-or-later
"""Further pictures of the material: `mfo.add_picture`, `mfo.remove_picture` and `mfo.set_up_next_picture`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import math

import bpy
from bpy.props import IntProperty
from mathutils import Matrix, Vector

from ..result import shown_result
from ..sentences.translated import translated


def add_picture(scene: bpy.types.Scene, camera: bpy.types.Object | None) -> bpy.types.PropertyGroup:
    """A new entry of the scene's list, with a camera and the current frame; the first picture keeps its own."""
    settings = scene.mfo
    if not settings.pictures:  # from now on the scene may show something else than the first picture
        settings.first_picture.camera, settings.first_picture.frame = scene.camera, scene.frame_current
    entry = settings.pictures.add()
    entry.camera, entry.frame = camera, scene.frame_current
    return entry


class MFO_OT_add_picture(bpy.types.Operator):
    """Fit one more picture of the same material at once: from another camera, at another frame"""

    bl_idname = "mfo.add_picture"
    bl_label = "Add Picture"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add an entry with the active camera and the current frame."""
        add_picture(context.scene, context.scene.camera)
        return {"FINISHED"}


class MFO_OT_remove_picture(bpy.types.Operator):
    """Take this picture off the list"""

    bl_idname = "mfo.remove_picture"
    bl_label = "Remove Picture"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}  # it needs a number

    index: IntProperty(name="Index", description="Counted from 0", min=0, options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove the entry."""
        pictures = context.scene.mfo.pictures
        if self.index >= len(pictures):
            self.report(
                {"ERROR"}, translated(f"There is no picture {self.index + 2}: the last is {len(pictures) + 1}.")
            )
            return {"CANCELLED"}
        pictures.remove(self.index)
        return {"FINISHED"}


class MFO_OT_set_up_next_picture(bpy.types.Operator):
    """Add the camera that the fit proposes, make it the scene's, and list its picture, which is to be made yet"""

    bl_idname = "mfo.set_up_next_picture"
    bl_label = "Set Up Camera"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a proposal and the camera that it turns."""
        found = shown_result.result
        if found is None or found.next_turn is None:
            cls.poll_message_set(translated("The last fit proposes no further picture"))
            return False
        if context.scene.camera is None:
            cls.poll_message_set(translated("The scene has no camera"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy the camera of the first picture, turned about the vertical through the object."""
        scene, found = context.scene, shown_result.result
        assert found is not None  # as `poll` has seen
        assert found.next_turn is not None
        settings = scene.mfo
        source = settings.first_picture.camera if settings.pictures else None
        source = source or scene.camera
        center = Vector(found.next_center)
        turn = Matrix.Rotation(math.radians(found.next_turn), 4, "Z")
        entry = add_picture(scene, None)
        camera = bpy.data.objects.new(f"{source.name} turned {found.next_turn:.0f}", source.data.copy())
        scene.collection.objects.link(camera)
        camera.matrix_world = Matrix.Translation(center) @ turn @ Matrix.Translation(-center) @ source.matrix_world
        scene.camera = entry.camera = camera
        self.report(
            {"INFO"}, translated(f"Camera {camera.name!r} is set up: make the picture from there and choose its file.")
        )
        return {"FINISHED"}


CLASSES = (MFO_OT_add_picture, MFO_OT_remove_picture, MFO_OT_set_up_next_picture)
