# SPDX-License-Identifier: Apache-2.0
"""Walk the main way by simulated mouse and keys alone: choose the reference, check, fit, apply, undo, history, asset.

Started with `--enable-event-simulate`. Buttons are found as a hand finds them: the mouse goes down the sidebar, and
Blender says what lies under it. Pictures of the screen go to the folder MFO_SCREENSHOTS, where it is set.
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
from steps import material, plain_picture, roughness, runtime

addon_id, folder, scale, width = sys.argv[sys.argv.index("--") + 1 :]
folder, scale, width = Path(folder), float(scale), int(width)
running_job, preflight, shown_result, waiting_backend = (
    importlib.import_module(f"{addon_id}.blender_addon.{name}")
    for name in ("running.running_job", "check.preflight", "result.shown_result", "process.waiting_backend")
)
STEP = 9  # pixels between two looks of the mouse, less than half a button's height at scale 1
HEIGHT = 1000  # of the screen
preferences = bpy.context.preferences
preferences.view.show_splash = False
preferences.view.ui_scale = scale


def window():
    return bpy.context.window_manager.windows[0]


def area():
    return next(a for a in window().screen.areas if a.type == "VIEW_3D")


def side_bar():
    return next(r for r in area().regions if r.type == "UI")


def view():
    return next(r for r in area().regions if r.type == "WINDOW")


def move(x, y):
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))


def click(x, y):
    """Press and release; Blender needs a moment in between, as with a hand."""
    move(x, y)
    yield 0.1
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x), y=int(y))
    yield 0.1
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x), y=int(y))
    yield 0.3


def key(kind, x, y, text="", **held):
    window().event_simulate(type=kind, value="PRESS", x=int(x), y=int(y), unicode=text, **held)
    yield 0.05
    window().event_simulate(type=kind, value="RELEASE", x=int(x), y=int(y), **held)
    yield 0.05


def typed(text, x, y):
    for letter in text:
        kind = letter.upper() if letter.isalpha() and letter.isascii() else "ZERO"
        yield from key(kind, x, y, letter)
    yield from key("RET", x, y)


def under_mouse():
    """What Blender would do if the button under the mouse were pressed, as Python; empty where there is none."""
    bpy.context.window_manager.clipboard = ""
    with bpy.context.temp_override(window=window(), area=area(), region=side_bar()):
        for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
            if copy.poll():
                copy()
                if bpy.context.window_manager.clipboard:
                    return bpy.context.window_manager.clipboard
    return ""


def wheel(turns):
    """Over the sidebar; the wheel's events are as a mouse sends them."""
    region = side_bar()
    x, y = region.x + region.width // 3, region.y + region.height // 2
    for _ in range(abs(turns)):
        kind = "WHEELDOWNMOUSE" if turns > 0 else "WHEELUPMOUSE"
        window().event_simulate(type=kind, value="PRESS", x=x, y=y)
        yield 0.03
    yield 0.4


def find(words, place, part=0.3, turns=12):
    """Move down the sidebar until a button's command has these words; `place` gets x and y.

    What is in sight is looked at first, then all of the sidebar from its top.
    """
    place.clear()
    for turn in range(turns):
        region = side_bar()
        x = region.x + part * (region.width - 24 * scale)
        for y in range(int(region.y + region.height - 8 * scale), region.y + 4, -int(STEP * scale)):
            move(x, y)
            yield 0.01
            if words in under_mouse():
                place.extend((x, y))
                return
        yield from wheel(6 if turn else -60)
    raise AssertionError(f"no button for {words}")


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


def widen():
    """Drag the sidebar's edge, as its width is no property."""
    region = side_bar()
    y, target = region.y + region.height // 2, region.x + region.width - width
    move(region.x, y)
    yield 0.2
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=region.x, y=y)
    for share in (0.3, 0.6, 1.0):
        yield 0.1
        move(region.x + share * (target - region.x), y)
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(target), y=y)
    yield 0.5


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
    yield from widen()


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
