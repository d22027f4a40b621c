# SPDX-License-Identifier: Apache-2.0
"""Walk the main way by simulated mouse and keys alone: choose the reference, check, fit, apply, undo, history, asset.

Started with `--enable-event-simulate`. Pictures of the screen go to the folder MFO_SCREENSHOTS, where it is set.
"""

import importlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import steps
from hand import area, click, find, key, move, side_bar, typed, view, wheel, widen, window
from steps import material, plain_picture, roughness, runtime

addon_id, *words = sys.argv[sys.argv.index("--") + 1 :]
folder, scale, width = Path(words[0]), float(words[1]), int(words[2])
running_job, preflight, shown_result, waiting_backend = (
    importlib.import_module(f"{addon_id}.blender_addon.{name}")
    for name in ("running.running_job", "check.preflight", "result.shown_result", "process.waiting_backend")
)
HEIGHT = 1000  # of the screen
preferences = bpy.context.preferences
preferences.view.show_splash = False
preferences.view.ui_scale = scale


def press(words, label="", part=0.3):
    place = []
    yield from find(words, place, part)
    yield from shot(label) if label else iter(())
    yield from click(*place)


def shot(name):
    if "MFO_SCREENSHOTS" in os.environ:
        preflight.redraw()
        yield 1.5  # panels grow and shrink in steps
        region = side_bar()
        crop = f"{region.width}x{region.height}+{region.x}+{HEIGHT - region.y - region.height}"
        tag = f"{bpy.app.version[0]}.{bpy.app.version[1]}_{scale:g}_{width}"
        path = os.path.join(os.environ["MFO_SCREENSHOTS"], f"hand_{tag}_{name}.png")
        subprocess.run(["import", "-window", "root", "-crop", crop, "+repage", path])


def until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds} s, state {runtime().state}: {runtime().sentence}"
        yield 0.05


def set_the_scene():
    plain_picture()
    os.environ["MFO_FAKE"] = json.dumps({"seconds": 4})
    with bpy.context.temp_override(window=window(), area=area(), region=view()):
        bpy.ops.screen.screen_full_area(use_hide_panels=False)
    yield 0.8
    area().spaces.active.show_region_ui = True
    yield 0.5
    side_bar().active_panel_category = "Material Fit"
    yield 0.8
    yield from widen(width)


def draw_part(path_field):
    """Open the part below the path, and drag a rectangle over the view; then let all of the picture count again."""
    part = bpy.context.scene.mfo.first_picture.part
    x, y = path_field
    yield from click(x, y - 28 * scale)
    yield from shot("part")
    yield from press("mfo.draw_part(")
    yield 0.5
    region = view()
    corners = [(region.x + a * region.width, region.y + b * region.height) for a, b in ((0.35, 0.65), (0.5, 0.45))]
    move(*corners[0])
    yield 0.2
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=int(corners[0][0]), y=int(corners[0][1]))
    for share in (0.3, 0.7, 1.0):
        yield 0.1
        move(*(a + share * (b - a) for a, b in zip(*corners, strict=True)))
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(corners[1][0]), y=int(corners[1][1]))
    yield from until(lambda: not part.is_whole, 5)
    assert 0.0 <= part.left < part.right <= 100.0, tuple(part.crop)
    assert not bpy.context.scene.render.use_border
    yield from shot("part_drawn")
    yield from press("mfo.whole_picture(", part=0.88)
    assert part.is_whole
    yield from click(x, y - 28 * scale)


def story():
    yield from set_the_scene()
    place = []
    yield from shot("1_first_look")
    yield from find("reference_path", place)
    for _ in range(2):  # a double click edits a text
        yield from click(*place)
    yield from typed(str(folder / "reference.png"), *place)
    assert bpy.context.scene.mfo.reference_path.endswith("reference.png"), bpy.context.scene.mfo.reference_path
    yield from until(lambda: preflight.summary()[1] == "CHECKMARK", 5)
    yield from draw_part(place)
    yield from press("mfo.check(")
    assert preflight.is_thorough
    yield from shot("2_checked")
    yield from press("mfo.fit(", "3_before_fit")
    yield from until(lambda: runtime().state == "RUNNING" and runtime().fraction > 0.1, 20)
    yield from shot("4_running")
    yield from until(lambda: runtime().state == "DONE" and len(material().mfo.history) == 1, 30)
    yield from shot("5_verdict")
    before = roughness()
    yield from press("mfo.apply(")
    assert roughness() == 0.3125, roughness()
    yield from shot("6_applied")
    over = (view().x + view().width // 3, view().y + view().height // 3)
    move(*over)
    yield 0.2
    yield from key("Z", *over, ctrl=True)
    yield 0.5
    assert roughness() == before, "Ctrl+Z"
    yield from key("Z", *over, ctrl=True, shift=True)
    yield 0.5
    assert roughness() == 0.3125, "Ctrl+Shift+Z"
    yield from press("mfo.revert(", part=0.7)  # beside A/B, or below it
    assert roughness() == before
    yield from press("mfo.apply_past(", "7_history")
    assert roughness() == 0.3125, "from the history"
    yield from press("mfo.save_as_asset(")
    assert material().asset_data is not None
    yield from shot("8_asset")
    yield from wheel(60)
    yield from shot("9_end")
    print("ALL GOOD by hand", flush=True)


steps.take(story())
