# SPDX-License-Identifier: Apache-2.0
r"""Walk a fit in Blender's windows with a real backend and take a picture of the sidebar at each step.

    python -m blender_addon.headless demo-scene DEMO
    python -m blender_addon.headless render DEMO/truth.blend --out REFERENCE.exr
    blender --factory-startup --window-geometry 0 0 1600 1000 --addons bl_ext.user_default.material_fit_mfo \
        --python artists_walk.py -- DEMO/start.blend REFERENCE.exr SHOTS

The screen is 1600x1000; ImageMagick's `import` takes the pictures. `tools/artists_pictures.py` puts them together.
"""

import importlib
import subprocess
import sys
import time
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import steps

ADDON = "bl_ext.user_default.material_fit_mfo.blender_addon"
HEIGHT = 1000  # of the screen in pixels
blend, reference, shots = sys.argv[sys.argv.index("--") + 1 :]
running_job, preflight = (importlib.import_module(f"{ADDON}.{n}") for n in ("running.running_job", "check.preflight"))
bpy.context.preferences.view.show_splash = False


def region(kind):
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    return area, next(r for r in area.regions if r.type == kind)


def over(kind="WINDOW"):
    area, found = region(kind)
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=found)


def press(operator, **options):
    with over():
        operator("INVOKE_DEFAULT", True, **options)


def scroll(steps):
    with over("UI"):
        for _ in range(steps):
            bpy.ops.view2d.scroll_down()


def shot(name):
    for _ in range(12):  # panels grow and shrink in steps, one with each draw
        preflight.redraw()
        yield 0.3
    side = region("UI")[1]
    crop = f"{side.width}x{side.height}+{side.x}+{HEIGHT - side.y - side.height}"
    subprocess.run(["import", "-window", "root", "-crop", crop, "+repage", f"{shots}/walk_{name}.png"], check=True)


def ended(seconds):
    end = time.monotonic() + seconds
    while running_job.current is not None and time.monotonic() < end:
        yield 0.1


def story():
    bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False)
    yield 1.0
    with over():
        bpy.ops.screen.screen_full_area(use_hide_panels=False)
    yield 1.0
    region("UI")[0].spaces.active.show_region_ui = True
    yield 0.5
    region("UI")[1].active_panel_category = "Material Fit"
    scene, head = bpy.context.scene, bpy.data.objects["Suzanne"]
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    scene.mfo.reference_path = bpy.path.relpath(reference)
    scene.render.use_multiview, scene.camera = True, None
    yield 1.0
    press(bpy.ops.mfo.mend, kind="camera", argument="Camera")
    yield from shot("1_check")
    press(bpy.ops.mfo.mend, kind="one_eye")
    yield 1.0
    press(bpy.ops.mfo.fit)
    end = time.monotonic() + 120.0
    while bpy.context.window_manager.mfo_runtime.fraction < 0.3 and time.monotonic() < end:
        yield 0.1
    yield from shot("2_running")
    yield from ended(300.0)
    yield from shot("3_done")
    press(bpy.ops.mfo.apply)
    press(bpy.ops.mfo.apply)  # a result that does not match is applied at the second press
    yield 1.0
    scroll(80)
    yield from shot("4_values")


steps.take(story())
