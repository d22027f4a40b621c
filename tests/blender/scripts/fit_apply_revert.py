# SPDX-License-Identifier: Apache-2.0
"""Fit with the fake backend, apply, undo, redo, revert; assert the sockets after each and what is imported."""

import sys
from pathlib import Path

import bpy

_addon_id, folder = sys.argv[sys.argv.index("--") + 1 :]
reference, job = str(Path(folder, "reference.png")), str(Path(folder, "job"))


def values() -> dict[str, object]:
    tree = bpy.data.objects["Cube"].active_material.node_tree
    node = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    plain = {}
    for socket in node.inputs:
        value = getattr(socket, "default_value", None)
        plain[socket.name] = tuple(value) if hasattr(value, "__len__") else value
    return plain


def is_start() -> bool:
    return values() == start


render = bpy.context.scene.render
render.resolution_x, render.resolution_y = 96, 64
bpy.context.scene.view_settings.view_transform = "Standard"
bpy.ops.ed.undo_push(message="start")
start = values()

assert bpy.ops.mfo.fit(reference=reference, job_folder=job) == {"FINISHED"}
assert bpy.context.window_manager.mfo_runtime.state == "DONE"
assert is_start()
assert bpy.ops.mfo.apply("EXEC_DEFAULT", True) == {"FINISHED"}
assert values()["Roughness"] == 0.3125, values()
assert values()["Metallic"] == 0.125
assert values()["Base Color"] != start["Base Color"]
bpy.ops.ed.undo()
assert is_start()
bpy.ops.ed.redo()
assert values()["Roughness"] == 0.3125
assert bpy.ops.mfo.revert() == {"FINISHED"}
assert is_start()
assert bpy.ops.mfo.show_pictures() == {"FINISHED"}
assert tuple(bpy.data.images["Material Fit comparison"].size) == (304, 64)

# without job_folder the job goes into the user folder of the extension
assert bpy.ops.mfo.fit(reference=reference) == {"FINISHED"}
assert "material_fit_mfo" in bpy.context.window_manager.mfo_runtime.job_folder

heavy = {"mitsuba", "drjit", "OpenEXR", "scipy", "mfo_backend"} & set(sys.modules)
assert not heavy, heavy
print("ALL GOOD")
