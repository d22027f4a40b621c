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


def in_german(text: str) -> str:
    view, before = bpy.context.preferences.view, bpy.context.preferences.view.language
    view.language = next((name for name in ("de_DE", "de") if name in bpy.app.translations.locales), before)
    try:
        return bpy.app.translations.pgettext(text, "Operator")
    finally:
        view.language = before


assert leftovers(), "the extension is not enabled"
has_german = bool({"de", "de_DE"} & set(bpy.app.translations.locales))
assert in_german("Fit Material") == ("Material anpassen" if has_german else "Fit Material")
package = sys.modules[addon_id].blender_addon
for _ in range(3):
    addon_utils.disable(addon_id)
    assert not leftovers(), leftovers()
    assert in_german("Fit Material") == "Fit Material"
    addon_utils.enable(addon_id)
    assert hasattr(bpy.types.Scene, "mfo")
package.unregister()
package.register()
addon_utils.disable(addon_id)
assert not leftovers(), leftovers()
state = package.backend.backend_state
timers = [package.running.running_job._tick, state._tick, state._first_look]
assert not any(map(bpy.app.timers.is_registered, timers))
assert not {"mitsuba", "drjit", "OpenEXR", "scipy"} & set(sys.modules)
print("ALL GOOD", "with German" if has_german else "without German")
