# SPDX-License-Identifier: Apache-2.0
"""Start a long fit, write both process ids down, wait to be killed."""

import importlib
import json
import os
import sys
from pathlib import Path

import bpy

folder = Path(sys.argv[sys.argv.index("--") + 1])
bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 64
bpy.context.scene.view_settings.view_transform = "Standard"
bpy.ops.mfo.fit(reference=str(folder / "reference.png"), job_folder=str(folder / "job"), wait=False)
running_job = importlib.import_module("bl_ext.user_default.material_fit_mfo.blender_addon.running.running_job")
(folder / "pids.part").write_text(json.dumps({"blender": os.getpid(), "backend": running_job.current.process.pid}))
os.replace(folder / "pids.part", folder / "pids.json")
running_job.wait(print)
