# SPDX-License-Identifier: Apache-2.0
"""Fit with interpreter and job root from the add-on preferences; without an interpreter the sentence says where."""

import sys
from pathlib import Path

import addon_utils
import bpy

addon_id, folder, python = sys.argv[sys.argv.index("--") + 1 :]
addon_utils.enable(addon_id, default_set=True)
preferences = bpy.context.preferences.addons[addon_id].preferences
bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 64
bpy.context.scene.view_settings.view_transform = "Standard"
reference = str(Path(folder, "reference.png"))
refusal = ""
try:
    bpy.ops.mfo.fit(reference=reference)
except RuntimeError as error:
    refusal = str(error)
assert "add-on preferences" in refusal, refusal
preferences.backend_python, preferences.job_root = python, str(Path(folder, "jobs"))
assert bpy.ops.mfo.fit(reference=reference) == {"FINISHED"}
assert bpy.context.window_manager.mfo_runtime.job_folder.startswith(str(Path(folder, "jobs")))
print("ALL GOOD")
