# SPDX-License-Identifier: Apache-2.0
r"""Film a fit by a real backend in Blender's windows, pressed by a simulated hand, for the README's moving picture.

    python -m blender_addon.headless demo-scene DEMO --scene-seed 11
    python -m blender_addon.headless render DEMO/truth.blend --out REFERENCE.exr --samples 256
    blender --factory-startup --enable-event-simulate --window-geometry 0 0 840 620 \
        --addons bl_ext.user_default.material_fit_mfo --python film.py -- DEMO/start.blend REFERENCE.exr FILM

The pictures and `film.json` (how long each is shown, where the mouse is) go to the folder FILM;
`tools/artists_pictures.py` puts them together. The reference stands on the left, the scene in the middle as Cycles
shows it, the panel on the right.
"""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import hand
import steps
from hand import area, click, find, move, side_bar, widen, window
from steps import runtime

ADDON = "bl_ext.user_default.material_fit_mfo.blender_addon"
SCREEN = 1000  # pixels high
REFERENCE_WIDTH, PANEL_WIDTH = 0.325, 272  # share of the window, pixels
CONVERGED = 120.0  # seconds that Cycles gets for the view
SPLITS = [0.5, 0.42, 0.34, 0.26, 0.18, 0.26, 0.34, 0.42, 0.5, 0.58, 0.66, 0.74, 0.82, 0.74, 0.66, 0.58, 0.5]
blend, reference, film = sys.argv[sys.argv.index("--") + 1 :]
running_job, preflight = (importlib.import_module(f"{ADDON}.{n}") for n in ("running.running_job", "check.preflight"))
preferences = bpy.context.preferences
preferences.view.show_splash = preferences.view.show_tooltips = preferences.system.use_region_overlap = False
taken = []
mouse = [420, 300]  # from below, in pixels of the window


def frame(milliseconds):
    """One picture of the window, which is shown so long."""
    name = f"{len(taken):03d}.png"
    crop = f"{window().width}x{window().height}+{window().x}+{SCREEN - window().y - window().height}"
    subprocess.run(["import", "-window", "root", "-crop", crop, "+repage", str(Path(film, name))], check=True)
    taken.append({"file": name, "milliseconds": milliseconds, "mouse": [mouse[0], window().height - mouse[1]]})


def settled(seconds=2.0):
    for _ in range(int(seconds / 0.2)):  # panels grow and shrink in steps, one with each draw
        preflight.redraw()
        yield 0.2


def press(words, milliseconds, part=0.3):
    """Find a button, go there in sight, press it."""
    place, before = [], list(mouse)
    yield from find(words, place, part)
    for share in (0.35, 0.75, 1.0):
        mouse[:] = (int(a + share * (b - a)) for a, b in zip(before, place, strict=True))
        move(*mouse)
        yield 0.3
        frame(milliseconds if share == 1.0 else 60)
    yield from click(*place)


def converged():
    """Let Cycles render the view, then hold it: noise that still changes would fill the film."""
    cycles = bpy.context.scene.cycles
    cycles.preview_pause = False
    yield CONVERGED
    cycles.preview_pause = True
    yield from settled()


def window_of(place):
    return next(region for region in place.regions if region.type == "WINDOW")


def columns():
    """The reference left, the view with its sidebar right, and nothing else."""
    for other in [a for a in window().screen.areas if a.type != "VIEW_3D"]:
        with bpy.context.temp_override(window=window(), area=other):
            bpy.ops.screen.area_close()
        yield 0.3
    with bpy.context.temp_override(window=window(), area=area()):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=REFERENCE_WIDTH)
    yield 0.5
    left = min(window().screen.areas, key=lambda a: a.x)
    left.type = "IMAGE_EDITOR"
    picture = bpy.data.images.load(reference)
    left.spaces.active.image, left.spaces.active.show_gizmo = picture, False
    yield 0.5
    with bpy.context.temp_override(window=window(), area=left, region=window_of(left)):
        bpy.ops.image.view_all(fit_view=True)
    space = area().spaces.active
    space.show_region_ui, space.show_region_toolbar, space.show_gizmo = True, False, False
    space.overlay.show_overlays = space.show_region_tool_header = window().screen.show_statusbar = False
    yield 0.5
    side_bar().active_panel_category = "Material Fit"
    yield from widen(PANEL_WIDTH)
    space.region_3d.view_perspective = "CAMERA"
    yield 0.5
    with bpy.context.temp_override(window=window(), area=area(), region=hand.view()):
        bpy.ops.view3d.view_center_camera()
    space.shading.type = "RENDERED"


def story():
    bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False)
    yield 1.0
    yield from columns()
    scene, head = bpy.context.scene, bpy.data.objects["Suzanne"]
    bpy.context.view_layer.objects.active = head
    head.select_set(True)
    scene.cycles.preview_samples, scene.cycles.use_preview_denoising = 256, True
    scene.mfo.reference_path = bpy.path.relpath(reference)
    yield from converged()
    frame(1500)
    yield from press("mfo.fit(", 400)
    while running_job.current is None:
        yield 0.05
    fraction = -1.0
    while running_job.current is not None:
        if runtime().fraction > fraction + 0.03:
            fraction = runtime().fraction
            preflight.redraw()
            yield 0.1
            frame(160)
        yield 0.05
    assert runtime().state == "DONE", runtime().sentence
    yield from settled()
    frame(1500)
    yield from press("mfo.apply(", 400)
    yield from converged()
    frame(1500)
    yield from press("split", 300, 0.7)
    left = min(window().screen.areas, key=lambda a: a.x)
    for share in SPLITS:
        runtime().split = share
        yield 0.3
        left.tag_redraw()
        yield 0.3
        frame(110)
    taken[-1]["milliseconds"] = 1500
    Path(film, "film.json").write_text(json.dumps(taken), "utf-8")
    print(f"ALL GOOD, {len(taken)} pictures", flush=True)


steps.take(story())
