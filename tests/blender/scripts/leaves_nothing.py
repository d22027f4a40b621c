# SPDX-License-Identifier: Apache-2.0
"""Disable and enable the extension several times; assert that no class, property, handler or timer stays."""

import sys

import addon_utils
import bpy

addon_id = sys.argv[sys.argv.index("--") + 1]


def leftovers() -> list[str]:
    found = [n for n in dir(bpy.types) if n.startswith("MFO_")]
    found += [f"{o}.mfo" for o in ("Scene", "Material") if hasattr(getattr(bpy.types, o), "mfo")]
    found += ["WindowManager.mfo_runtime"] if hasattr(bpy.types.WindowManager, "mfo_runtime") else []
    for name in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, name)
        if isinstance(handlers, list):
            found += [f"{name}: {h}" for h in handlers if "material_fit" in getattr(h, "__module__", "")]
    for name in ("VIEW3D_MT_object", "MATERIAL_MT_context_menu"):
        drawn = getattr(getattr(bpy.types, name).draw, "_draw_funcs", ())
        found += [f"{name}: {f}" for f in drawn if "material_fit" in getattr(f, "__module__", "")]
    return found


assert leftovers(), "the extension is not enabled"
package = sys.modules[addon_id].blender_addon
for _ in range(3):
    addon_utils.disable(addon_id)
    assert not leftovers(), leftovers()
    addon_utils.enable(addon_id)
    assert hasattr(bpy.types.Scene, "mfo")
package.unregister()
package.register()
addon_utils.disable(addon_id)
assert not leftovers(), leftovers()
print("ALL GOOD")
