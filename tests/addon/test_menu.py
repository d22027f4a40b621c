# SPDX-License-Identifier: Apache-2.0
"""F3 finds what is in a menu: every operator for users is, and no key map of ours exists; paths may be relative."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

MENU = Path(__file__).resolve().parents[2] / "blender_addon" / "panel" / "menu.py"


def test_every_operator_is_in_the_menu(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    listed = set(re.findall(r'"mfo\.(\w+)"', MENU.read_text("utf-8")))
    ours = {name: getattr(bpy.types, f"MFO_OT_{name}") for name in dir(bpy.ops.mfo)}
    wanted = {name for name, cls in ours.items() if "INTERNAL" not in cls.bl_options}
    assert listed == wanted
    for name, cls in ours.items():
        assert (cls.__doc__ or "").strip(), name
        assert getattr(cls, "bl_label", ""), name


def test_what_changes_data_can_be_undone(scene: SimpleNamespace) -> None:
    types = scene.bpy.types
    for name in ("apply", "revert", "toggle", "apply_past", "remove_past", "open_job", "mend", "show_pictures",
                 "record_results", "use_reference", "limit_value"):  # fmt: skip
        assert "UNDO" in getattr(types, f"MFO_OT_{name}").bl_options, name


def test_no_key_map(scene: SimpleNamespace) -> None:
    keys = scene.bpy.context.window_manager.keyconfigs.addon
    items = [item.idname for keymap in (keys.keymaps if keys else ()) for item in keymap.keymap_items]
    assert not [name for name in items if name.startswith("mfo.")]


def test_reference_may_be_relative(scene: SimpleNamespace) -> None:
    path = scene.bpy.context.scene.mfo.bl_rna.properties["reference_path"]
    assert getattr(path, "is_path_supports_blend_relative", True)  # Blender before 4.5 does not ask
