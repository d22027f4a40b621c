# SPDX-License-Identifier: Apache-2.0
r"""Seconds from the press of *Fit* to the first picture and to the result, in Blender's windows, with a real backend.

    python -m blender_addon.headless demo-scene DEMO
    python -m blender_addon.headless render DEMO/truth.blend --out REFERENCE.exr
    blender --factory-startup --addons bl_ext.user_default.material_fit_mfo \
        --python press_to_result.py -- DEMO/start.blend REFERENCE.exr [--fits 6]

The first fit starts its backend, each later one takes the backend that has waited since the fit before.
"""

import argparse
import importlib
import statistics
import sys
import time
from pathlib import Path

import bpy

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1])]
import steps
import stopwatch
from steps import over, runtime, until

ADDON = "bl_ext.user_default.material_fit_mfo.blender_addon"
LOOK = 0.005  # seconds between two looks
running_job, previews, waiting_backend = (
    importlib.import_module(f"{ADDON}.{name}")
    for name in ("running.running_job", "pictures.previews", "process.waiting_backend")
)
parser = argparse.ArgumentParser()
parser.add_argument("blend")
parser.add_argument("reference")
parser.add_argument("--fits", type=int, default=6)
chosen = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
bpy.context.preferences.view.show_splash = False
stopwatch.time_the_addon(ADDON)


def fit(rows):
    """One press; `rows` gets its seconds to the first picture and to the result."""
    began = time.perf_counter()
    with over():
        bpy.ops.mfo.fit("INVOKE_DEFAULT", True)
    yield from until(lambda: previews.icon("current") or runtime().state in ("DONE", "FAILED"), 120.0, LOOK)
    first = time.perf_counter() - began
    yield from until(lambda: runtime().state in ("DONE", "FAILED"), 120.0, LOOK)
    rows.append((first, time.perf_counter() - began))
    print(f"picture {rows[-1][0]:.2f} s, result {rows[-1][1]:.2f} s: {runtime().sentence}", flush=True)
    assert runtime().state == "DONE", runtime().sentence


def story():
    bpy.ops.wm.open_mainfile(filepath=chosen.blend, load_ui=False)
    yield 1.0
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    area.spaces.active.show_region_ui = True
    yield 0.5
    next(r for r in area.regions if r.type == "UI").active_panel_category = "Material Fit"
    bpy.context.view_layer.objects.active = bpy.data.objects["Suzanne"]
    bpy.data.objects["Suzanne"].select_set(True)
    bpy.context.scene.mfo.reference_path = chosen.reference
    yield 3.0
    rows = []
    for _ in range(chosen.fits):
        yield from fit(rows)
        yield from until(lambda: waiting_backend.memory_mb(), 60.0)  # loaded
        yield 1.0
    for name, at in (("first picture", 0), ("result", 1)):
        later = [row[at] for row in rows[1:]]
        print(f"{name}: anew {rows[0][at]:.2f} s, waiting {statistics.median(later):.2f} ({max(later):.2f}) s")
    print("longest calls, ms of wall (processor) time:", stopwatch.slowest(), flush=True)


steps.take(story())
