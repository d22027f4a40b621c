# SPDX-License-Identifier: Apache-2.0
"""Inside Blender: fit and apply with the real backend, render with Cycles, save."""

import sys
from pathlib import Path

import bpy

reference, folder = (Path(word) for word in sys.argv[sys.argv.index("--") + 1 :])
assert bpy.ops.mfo.fit(object="Suzanne", reference=str(reference), job_folder=str(folder / "job")) == {"FINISHED"}
assert bpy.ops.mfo.apply() == {"FINISHED"}
scene = bpy.context.scene
scene.cycles.samples, scene.cycles.seed = 64, 7
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "IMAGE"
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = str(folder / "after.exr")
bpy.ops.render.render(write_still=True)
assert not {"mitsuba", "drjit", "OpenEXR"} & set(sys.modules)
print("ALL GOOD")
