# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.save_as_asset` and `mfo.start_from`: materials with recovered values on the shelf, and from it."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import bpy
from bpy.props import EnumProperty

from ..check.preflight import redraw
from ..export.nodes.target_shader import target_shader
from ..result.asset import AssetError, save_as_asset
from ..result.local_copy import unwritable
from ..result.start_values import StartError, take_values
from ..sentences.translated import translated

_items: list[tuple[str, str, str]] = []  # Blender keeps no copy of what a callback returns


class MFO_OT_save_as_asset(bpy.types.Operator):
    """Mark the material as an asset, with its verdict, its reference and the picture of its fit"""

    bl_idname = "mfo.save_as_asset"
    bl_label = "Save as Asset"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """In windows only for a material of this file that shows recovered values."""
        material = context.object.active_material if context.object else None
        if bpy.app.background:
            return True
        if material is None or not material.mfo.job_folder or material.mfo.shows_original:
            cls.poll_message_set(translated("Apply a result to the active material first"))
            return False
        if unwritable(material):
            cls.poll_message_set(translated(unwritable(material)))
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Mark and describe it."""
        material = context.object.active_material if context.object else None
        try:
            if material is None:
                raise AssetError("The active object has no material: select the one whose result was applied.")
            if unwritable(material):
                raise AssetError(unwritable(material))
            shown = save_as_asset(material)
        except AssetError as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        redraw()
        where = "save the file and add its folder as an asset library to find it in other files."
        self.report(
            {"INFO"}, translated(f"Material '{material.name}' is an asset now; its preview shows {shown}: {where}")
        )
        return {"FINISHED"}


def _others(_self: object, context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    """The other materials of the file whose values can be taken."""
    active = context.object.active_material if context is not None and context.object else None
    names = [m.name for m in bpy.data.materials if m != active and target_shader(m) is not None]
    _items[:] = [(name, name, "") for name in names]
    return _items


class MFO_OT_start_from(bpy.types.Operator):
    """Begin with the values of another material of this file; nodes and links stay as they are"""

    bl_idname = "mfo.start_from"
    bl_label = "Start From"
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "material"

    material: EnumProperty(name="Material", description="Whose values are taken", items=_others)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only for a material whose values are fitted."""
        material = context.object.active_material if context.object else None
        if target_shader(material) is None:
            cls.poll_message_set(translated("The active material has no shader whose values are fitted"))
            return False
        if unwritable(material):
            cls.poll_message_set(translated(unwritable(material)))
            return False
        return True

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Search the materials by name."""
        if not _others(self, context):
            self.report({"WARNING"}, translated("There is no other material in this file whose values could be taken."))
            return {"CANCELLED"}
        context.window_manager.invoke_search_popup(self)
        return {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Take the values."""
        material, other = context.object.active_material, bpy.data.materials.get(self.material)
        try:
            if other is None:
                raise StartError(f"There is no material '{self.material}' in this file: choose another.")
            changed = take_values(material, other)
        except StartError as error:
            self.report({"ERROR"}, translated(str(error)))
            return {"CANCELLED"}
        self.report(
            {"INFO"},
            translated(f"Taken from '{other.name}': {', '.join(changed) or 'nothing, the values are the same'}."),
        )
        return {"FINISHED"}


CLASSES = (MFO_OT_save_as_asset, MFO_OT_start_from)
