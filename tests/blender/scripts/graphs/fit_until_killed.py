# SPDX-License-Identifier: Apache-2.0
"""Start a fit of values inside nodes, write this process' id down, wait to be killed; also with the bpy module."""

import importlib
import os
import sys
from pathlib import Path

import bpy

folder, addon = [*sys.argv[sys.argv.index("--") + 1 :], ""][:2]
if not addon:
    import blender_addon

    blender_addon.register()
package = f"{addon}.blender_addon" if addon else "blender_addon"
scene = bpy.context.scene
scene.render.resolution_x = scene.render.resolution_y = 48
scene.view_settings.view_transform = "Standard"
tree = bpy.data.objects["Cube"].active_material.node_tree
shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
noise, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
tree.links.new(noise.outputs[0], ramp.inputs[0])
tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/scene.blend")
bpy.ops.mfo.fit(reference=f"{folder}/reference.png", job_folder=f"{folder}/job", wait=False)
Path(folder, "pid.part").write_text(str(os.getpid()))
os.replace(f"{folder}/pid.part", f"{folder}/pid")
importlib.import_module(f"{package}.running.running_job").wait(print)
