# SPDX-License-Identifier: GPL-3.0-or-later
"""Further pictures of the material: `mfo.add_picture`, `mfo.remove_picture` and `mfo.set_up_next_picture`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy
from bpy.props import IntProperty

from ..result import shown_result
from ..result.next_picture import scene_with_light, turned_camera
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
    """Set the camera or the light up that the fit proposes, and list the picture, which is to be made yet"""

    bl_idname = "mfo.set_up_next_picture"
    bl_label = "Set Up Next Picture"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a proposal and what it is made of."""
        found = shown_result.result
        if found is None or found.next_picture is None:
            cls.poll_message_set(translated("The last fit proposes no further picture"))
            return False
        if context.scene.camera is None:
            cls.poll_message_set(translated("The scene has no camera"))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the camera, or a scene with the light, and an entry of the list."""
        scene, found = context.scene, shown_result.result
        assert found is not None  # as `poll` has seen
        proposed = found.next_picture
        assert proposed is not None
        settings = scene.mfo
        source = settings.first_picture.camera if settings.pictures else None
        source = source or scene.camera
        missing = next((n for n in (proposed.camera, proposed.light) if n and n not in scene.objects), None)
        if missing is not None:
            self.report({"ERROR"}, translated(f"The scene has no object {missing!r} any more: run the fit again."))
            return {"CANCELLED"}
        if proposed.light:
            entry = add_picture(scene, source)
            entry.scene = scene_with_light(scene, proposed)
            entry.scene.camera = source
            said = f"Scene {entry.scene.name!r} is set up: make the picture from there and choose its file."
        else:
            entry = add_picture(scene, None)
            own = scene.objects[proposed.camera] if proposed.camera else turned_camera(scene, source, proposed)
            scene.camera = entry.camera = own
            said = f"Camera {own.name!r} is set up: make the picture from there and choose its file."
        self.report({"INFO"}, translated(said))
        return {"FINISHED"}


CLASSES = (MFO_OT_add_picture, MFO_OT_remove_picture, MFO_OT_set_up_next_picture)
