# SPDX-License-Identifier: Apache-2.0
"""Walk the main way by mouse and keys alone: choose the reference, check, fit, apply, undo, history, asset.

With `--enable-event-simulate` the events begin in Blender. Without it they come from the X server, and the walk begins
with a Blender that has no extension yet: the zip is installed from disk, the reference dropped onto the panel, and at
the end Blender is left. Pictures of the screen go to the folder MFO_SCREENSHOTS, where it is set.
"""

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))

import steps
from desktop import from_disk
from hand import (
    SCREEN_HEIGHT,
    click,
    drag,
    drop,
    find,
    key,
    move,
    side_bar,
    typed,
    view,
    wheel,
    widen,
)
from steps import material, plain_picture, roughness, runtime, until

addon_id, *words = sys.argv[sys.argv.index("--") + 1 :]
folder, scale, width = Path(words[0]), float(words[1]), int(words[2])
package = Path(words[3]) if len(words) > 3 else None
preferences = bpy.context.preferences
preferences.view.show_splash = False
preferences.view.ui_scale = scale


# pixels at scale 1 of the line below a path that its field cuts, as it does that of every test's folder
NAME_BELOW = 18


def module(name):
    """One of the add-on, which may be installed on the way."""
    return importlib.import_module(f"{addon_id}.blender_addon.{name}")


def press(words, label="", part=0.3):
    place = []
    yield from find(words, place, part)
    yield from shot(label) if label else iter(())
    yield from click(*place)


def shot(name, *, whole=False):
    """Of the side bar, or of the screen."""
    if "MFO_SCREENSHOTS" not in os.environ:
        return
    yield 0.7
    crop = []
    if not whole:
        region = side_bar()
        module("check.preflight").redraw()
        yield 1.0  # panels grow and shrink in steps
        place = f"{region.width}x{region.height}+{region.x}+{SCREEN_HEIGHT - region.y - region.height}"
        crop = ["-crop", place, "+repage"]
    tag = f"{bpy.app.version[0]}.{bpy.app.version[1]}_{scale:g}_{width}{'_x' if package else ''}"
    path = os.path.join(os.environ["MFO_SCREENSHOTS"], f"hand_{tag}_{name}.png")
    subprocess.run(["import", "-window", "root", *crop, path])


def screen_shot(name):
    yield from shot(name, whole=True)


def set_the_scene():
    plain_picture()
    os.environ["MFO_FAKE"] = json.dumps({"seconds": 4})
    middle = (view().x + view().width // 2, view().y + view().height // 2)
    move(*middle)
    yield 0.3
    yield from key("SPACE", *middle, ctrl=True)
    yield 1.0
    yield from from_disk.side_bar_by_key()
    yield 0.8
    yield from widen(width)


def choose(reference):
    """Drop it onto the panel, or write its path."""
    place = []
    if package:
        bar = side_bar()
        yield from drop(reference, bar.x + 0.4 * bar.width, bar.y + 0.6 * bar.height)
        yield from key("RET", bar.x, bar.y)  # Blender 5.2 asks what it is for; the mouse is on the answer
        yield 0.5
    yield from find("reference_path", place)
    if not package:
        for _ in range(2):  # a double click edits a text
            yield from click(*place)
        yield from typed(str(reference), *place)
    assert bpy.context.scene.mfo.reference_path.endswith("reference.png"), bpy.context.scene.mfo.reference_path
    yield from until(lambda: module("check.preflight").summary()[1] == "CHECKMARK", 10)
    return place


def draw_part(path_field):
    """Open the part below the path, and drag a rectangle over the view; then let all of the picture count again."""
    part = bpy.context.scene.mfo.first_picture.part
    x, y = path_field
    below = y - (28 + NAME_BELOW) * scale
    yield from click(x, below)
    yield from shot("part")
    yield from press("mfo.draw_part(")
    yield 0.5
    region = view()
    corners = [(region.x + a * region.width, region.y + b * region.height) for a, b in ((0.35, 0.65), (0.5, 0.45))]
    yield from drag(*corners)
    yield from until(lambda: not part.is_whole, 5)
    assert 0.0 <= part.left < part.right <= 100.0, tuple(part.crop)
    assert not bpy.context.scene.render.use_border
    yield from shot("part_drawn")
    yield from press("mfo.whole_picture(", part=0.88)
    assert part.is_whole
    yield from click(x, below)


def story():
    if package:
        yield from from_disk.install(package, screen_shot)
        yield from from_disk.installed(addon_id)
        yield from screen_shot("i5_installed")
        yield from from_disk.close_preferences()
    yield from set_the_scene()
    yield from shot("1_first_look")
    place = yield from choose(folder / "reference.png")
    yield from draw_part(place)
    yield from press("mfo.check(")
    assert module("check.preflight").is_thorough
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
    if package:
        yield from from_disk.leave(screen_shot)
        yield 10.0
        print("script error: Blender is still there", flush=True)


steps.take(story())
