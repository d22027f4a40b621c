# SPDX-License-Identifier: GPL-3.0-or-later
"""A menu with every operator, so that F3 finds them and each can get a shortcut; there is no key map of our own."""

from __future__ import annotations

import bpy


class MFO_MT_material_fit(bpy.types.Menu):
    """Material Fit, in the menu Object and in the menu of the material slots."""

    bl_idname = "MFO_MT_material_fit"
    bl_label = "Material Fit"

    def draw(self, _context: bpy.types.Context) -> None:
        """List the operators in the order of the work."""
        layout = self.layout
        for names in (
            (
                "mfo.check",
                "mfo.render_reference",
                "mfo.overlay_reference",
                "mfo.draw_part",
                "mfo.paint_mask",
                "mfo.take_render_region",
                "mfo.whole_picture",
                "mfo.add_picture",
                "mfo.set_up_next_picture",
            ),
            (
                "mfo.start_from",
                "mfo.fit",
                "mfo.fit_selected",
                "mfo.list_materials",
                "mfo.clear_materials",
                "mfo.cancel",
            ),
            ("mfo.show_pictures", "mfo.check_in_cycles", "mfo.cancel_cycles", "mfo.open_report", "mfo.open_job"),
            ("mfo.apply", "mfo.toggle", "mfo.revert", "mfo.copy_values", "mfo.save_as_asset"),
            ("mfo.apply_past", "mfo.show_past", "mfo.remove_past"),
            ("mfo.install_backend", "mfo.cancel_install", "mfo.test_backend", "mfo.remove_backend"),
            ("mfo.open_install_log",),
        ):
            for name in names:
                layout.operator(name)
            layout.separator()


def _draw(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.menu(MFO_MT_material_fit.bl_idname)


_MENUS = ("VIEW3D_MT_object", "MATERIAL_MT_context_menu")


def register() -> None:
    """Hang the menu into Blender's own."""
    for name in _MENUS:
        getattr(bpy.types, name).append(_draw)


def unregister() -> None:
    """Take it out again."""
    for name in _MENUS:
        getattr(bpy.types, name).remove(_draw)
