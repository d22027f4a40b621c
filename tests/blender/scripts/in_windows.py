# SPDX-License-Identifier: Apache-2.0
"""Drive the extension in windows by a timer: each `yield` gives Blender time to draw and to run the add-on's timer.

Pictures of the screen go to the folder MFO_SCREENSHOTS, where ImageMagick's `import` can take them.
"""

import importlib
import json
import os
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path

import addon_utils
import bpy

addon_id, folder = sys.argv[sys.argv.index("--") + 1 :]
folder = Path(folder)
running_job = importlib.import_module(f"{addon_id}.blender_addon.running_job")
panel = importlib.import_module(f"{addon_id}.blender_addon.panel")
LONGEST_STALL = 0.05  # seconds
spent: list[float] = []
bpy.context.preferences.view.show_splash = False


def timed(function, *arguments):
    began = time.perf_counter()
    try:
        return function(*arguments)
    finally:
        spent.append(time.perf_counter() - began)


def timed_draw(draw):
    return lambda self, context: timed(draw, self, context)  # Blender counts the arguments


the_tick = running_job._tick
running_job._tick = lambda: timed(the_tick)
for cls in panel.CLASSES:
    if issubclass(cls, bpy.types.Panel):
        cls.draw = timed_draw(cls.draw)


def over():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def show_tab():
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    area.spaces.active.show_region_ui = True
    yield 0.5
    next(r for r in area.regions if r.type == "UI").active_panel_category = "Material Fit"
    area.tag_redraw()
    yield 1.0


def shot(name):
    if "MFO_SCREENSHOTS" in os.environ:
        subprocess.run(["import", "-window", "root", os.path.join(os.environ["MFO_SCREENSHOTS"], name + ".png")])


def runtime():
    return bpy.context.window_manager.mfo_runtime


def roughness():
    tree = bpy.data.objects["Cube"].active_material.node_tree
    return next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED").inputs["Roughness"].default_value


def settings():
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 96, 64
    bpy.context.scene.view_settings.view_transform = "Standard"
    bpy.context.scene.mfo.reference_path = str(folder / "reference.png")


def fit(seconds, **control):
    os.environ["MFO_FAKE"] = json.dumps({"seconds": seconds, **control})
    with over():
        assert bpy.ops.mfo.fit() == {"FINISHED"}
    return running_job.current.process


def until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds} s, state {runtime().state}: {runtime().sentence}"
        yield 0.05


def alive(process):
    return process._process.poll() is None


def story():
    yield from show_tab()
    settings()
    shot("1_idle")

    process = fit(8)
    yield from until(lambda: runtime().fraction > 0.3, 10)
    assert runtime().state == "RUNNING"
    assert not bpy.ops.mfo.apply.poll()
    shot("2_running")
    assert bpy.ops.mfo.cancel() == {"FINISHED"}
    asked = time.time()
    yield from until(lambda: runtime().state == "DONE", 10)  # drawing without a graphics card takes a second
    assert (process.folder / "result.json").stat().st_mtime - asked < 1.0
    assert "best values so far" in runtime().sentence
    yield 0.5
    shot("3_cancelled")

    fit(1)
    yield from until(lambda: runtime().state == "DONE", 10)
    yield 0.5
    shot("4_done")
    with over():
        bpy.ops.ed.undo_push(message="before")
        assert bpy.ops.mfo.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert roughness() == 0.3125
    yield 0.5
    shot("5_applied")
    for _ in range(20):
        with over():
            bpy.ops.ed.undo()
        assert roughness() == 0.5
        with over():
            bpy.ops.ed.redo()
        assert roughness() == 0.3125
        yield 0.02
    with over():
        assert bpy.ops.mfo.revert() == {"FINISHED"}
    assert roughness() == 0.5

    process = fit(60)
    yield from until(lambda: runtime().fraction > 0, 10)
    with over():
        bpy.ops.ed.undo_push(message="while it runs")
        bpy.ops.ed.undo()
    bpy.data.objects["Cube"].name = "Cube renamed"
    yield 0.5
    assert runtime().state == "RUNNING"
    os.kill(process.pid, signal.SIGKILL)
    yield from until(lambda: runtime().state == "FAILED", 5)
    assert "was killed" in runtime().sentence
    yield 0.5
    shot("6_killed")

    process = fit(60)
    yield from until(lambda: runtime().fraction > 0, 10)
    bpy.ops.wm.read_homefile(app_template="")
    assert not alive(process)
    yield 1.0
    assert runtime().state == "IDLE"
    yield from show_tab()
    settings()

    process = fit(60)
    yield from until(lambda: runtime().fraction > 0, 10)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    yield 0.5
    assert runtime().state == "RUNNING"
    tick = running_job._tick
    addon_utils.disable(addon_id)
    assert not alive(process)
    assert not bpy.app.timers.is_registered(tick)
    yield 1.0  # draws without the panel
    stall = max(spent)
    assert stall < LONGEST_STALL, f"{stall * 1000:.1f} ms"
    print(f"ALL GOOD, longest stall {stall * 1000:.1f} ms in {len(spent)} calls", flush=True)


steps = story()


def tick():
    try:
        return next(steps)
    except StopIteration:
        pass
    except BaseException:
        traceback.print_exc(file=sys.stdout)
        sys.stdout.flush()
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=2.0, persistent=True)
