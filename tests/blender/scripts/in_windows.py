# SPDX-License-Identifier: Apache-2.0
"""Drive the extension in windows by a timer: each `yield` gives Blender time to draw and to run the add-on's timers.

Pictures of the screen go to the folder MFO_SCREENSHOTS, where ImageMagick's `import` can take them.
"""

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import addon_utils
import bpy

sys.path += [str(Path(__file__).parent), str(Path(__file__).parent / "timing")]
import steps
import stopwatch
from steps import material, over, plain_picture, roughness, runtime, until

addon_id, folder = sys.argv[sys.argv.index("--") + 1 :]
folder = Path(folder)
running_job, running_export, preflight, fit_queue, handlers, cycles_check, shown_result, waiting_backend = (
    importlib.import_module(f"{addon_id}.blender_addon.{name}")
    for name in (
        *("running.running_job", "running.running_export", "check.preflight", "running.fit_queue"),
        *("running.handlers", "running.cycles_check", "result.shown_result", "process.waiting_backend"),
    )
)
LONGEST_STALL = 0.05  # seconds
bpy.context.preferences.view.show_splash = False
stopwatch.time_the_addon(f"{addon_id}.blender_addon")


def do(operator, **options):
    """As a press of its button: with the window's context and one undo step."""
    with over():
        assert operator.poll(), operator.idname()
        assert operator("EXEC_DEFAULT", True, **options) == {"FINISHED"}, operator.idname()


def side_bar():
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    return area, next(r for r in area.regions if r.type == "UI")


def show_tab():
    area, region = side_bar()
    area.spaces.active.show_region_ui = True
    yield 0.5
    region.active_panel_category = "Material Fit"
    area.tag_redraw()
    yield 1.5


def scroll(steps):
    """Turn the wheel over the side bar; Blender has no operator for it that takes a context."""
    area, region = side_bar()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=region):
        for _ in range(abs(steps)):
            (bpy.ops.view2d.scroll_down if steps > 0 else bpy.ops.view2d.scroll_up)()


def shot(name):
    if "MFO_SCREENSHOTS" in os.environ:
        preflight.redraw()
        yield 2.5  # panels grow and shrink in steps
        target = os.path.join(os.environ["MFO_SCREENSHOTS"], f"{bpy.app.version[0]}.{bpy.app.version[1]}_{name}.png")
        subprocess.run(["import", "-window", "root", target])


def settings():
    plain_picture()
    bpy.context.scene.mfo.reference_path = str(folder / "reference.png")


def fit(seconds, **control):
    os.environ["MFO_FAKE"] = json.dumps({"seconds": seconds, **control})
    waiting_backend.close()  # one that waits has the environment of an earlier fit
    do(bpy.ops.mfo.fit)
    while running_export.current is not None:  # on busy cores a press ends before the export
        running_export._tick()
    return running_job.current.process


def alive(process):
    return process.backend.is_alive


def stops():
    return {
        kind for finding in preflight.findings if finding.level == "stops" for kind in (f.kind for f in finding.fixes)
    }


def check_and_mend():
    """A scene where a lot is wrong, mended by the buttons alone, each one undo step."""
    scene = bpy.context.scene
    bpy.ops.ed.undo_push(message="new scene")
    scene.render.use_multiview = True
    scene.camera = None
    tree = material().node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    principled = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(noise.outputs[0], principled.inputs["Roughness"])
    scene.mfo.reference_path = str(folder / "reference.png")
    bpy.ops.ed.undo_push(message="all wrong")
    yield from until(lambda: stops() >= {"camera", "resolution"}, 5)
    yield from shot("01_check_stops")
    do(bpy.ops.mfo.mend, kind="camera", argument="Camera")
    yield from until(lambda: "one_eye" in stops(), 5)
    for kind, argument in (
        ("one_eye", ""), ("unlink", "Roughness"), ("resolution", "96x64"), ("cycles", ""),
    ):  # fmt: skip
        do(bpy.ops.mfo.mend, kind=kind, argument=argument)
        yield 0.05
    assert not [f for f in preflight.findings if f.level != "fine"], preflight.findings
    with over():
        bpy.ops.ed.undo()
    assert bpy.context.scene.render.engine != "CYCLES"
    yield from until(lambda: any(f.kind == "cycles" for g in preflight.findings for f in g.fixes), 5)
    with over():
        bpy.ops.ed.redo()
    bpy.context.scene.cycles.samples = 1
    yield 0.6
    do(bpy.ops.mfo.check)
    assert preflight.is_thorough
    yield from shot("02_check_ready")
    bpy.context.scene.mfo.parameter_set = "chosen"
    do(bpy.ops.mfo.limit_value, name="roughness")
    yield 2.0  # the longest list of all
    yield from shot("03_values_chosen")
    bpy.context.scene.mfo.parameter_set = "all"


def look_back():
    """A/B, history, pictures at full size, the check in Cycles."""
    do(bpy.ops.mfo.toggle)
    assert roughness() == 0.5
    do(bpy.ops.mfo.toggle)
    assert roughness() == 0.3125
    kept = material().mfo
    assert [entry.partial for entry in kept.history] == [False, True]
    kept.history_index = 1
    do(bpy.ops.mfo.show_past)
    assert "best values so far" in runtime().sentence
    kept.history_index = 0
    do(bpy.ops.mfo.show_past)
    do(bpy.ops.mfo.apply_past)
    do(bpy.ops.mfo.check_in_cycles)
    assert not bpy.ops.mfo.check_in_cycles.poll()
    yield from until(lambda: "sample" in runtime().cycles_text or not cycles_check.is_running(), 60)
    yield from until(lambda: not cycles_check.is_running(), 90)
    assert runtime().cycles_text == "FLIP in Cycles: 0.0234", runtime().cycles_text
    yield 0.3
    scroll(12)
    yield from shot("08_cycles_and_history")
    scroll(60)
    yield from shot("09_history")
    scroll(-100)
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "PROPERTIES")
    area.spaces.active.context = "MATERIAL"
    yield 1.0
    with bpy.context.temp_override(
        window=bpy.context.window_manager.windows[0],
        area=area,
        region=next(r for r in area.regions if r.type == "WINDOW"),
    ):
        for _ in range(60):
            bpy.ops.view2d.scroll_down()
    yield from shot("10_material_properties")
    do(bpy.ops.mfo.show_pictures, show="split")
    yield 1.0
    editors = [a for w in bpy.context.window_manager.windows for a in w.screen.areas if a.type == "IMAGE_EDITOR"]
    assert [a.spaces.active.image.name for a in editors] == ["Material Fit split"]
    runtime().split = 0.25
    yield from shot("11_split")
    do(bpy.ops.mfo.show_pictures, show="strip")
    yield from shot("12_strip")
    for window in list(bpy.context.window_manager.windows)[1:]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.window_close()


def waits():
    """After a fit a backend waits for the next one, which takes it."""
    fit(1)
    yield from until(lambda: runtime().state == "DONE" and waiting_backend.memory_mb() == 210, 20)
    backend = waiting_backend._waiting
    do(bpy.ops.mfo.fit)
    assert running_job.current.process.backend is backend
    yield from until(lambda: runtime().state == "DONE", 20)


def in_queue():
    """Fits that wait, run or have ended."""
    return len(fit_queue.waiting) + len(fit_queue.finished) + (running_job.current is not None)


def queue():
    """Three materials, one after the other, each result in the history of its own."""
    for i in (1, 2):
        bpy.ops.mesh.primitive_cube_add(location=(1.5, 0.8 * i - 1.2, 0.0), size=0.5)
        cube = bpy.context.object
        cube.name = f"Cube {i}"
        cube.data.materials.append(bpy.data.materials.new(f"Glaze {i}"))
        if cube.active_material.node_tree is None:
            cube.active_material.use_nodes = True
    for name in ("Cube", "Cube 1", "Cube 2"):
        bpy.data.objects[name].select_set(True)
    os.environ["MFO_FAKE"] = json.dumps({"seconds": 6})
    waiting_backend.close()
    do(bpy.ops.mfo.fit_selected)
    # on busy cores the first may have ended before the last was exported
    yield from until(lambda: running_export.current is None and in_queue() == 3, 60)
    yield from until(lambda: len(fit_queue.finished) >= 1 and runtime().fraction > 0.3, 30)
    yield from shot("13_queue")
    yield from until(lambda: len(fit_queue.finished) == 3 and not running_job.unrecorded, 40)
    assert [len(bpy.data.materials[f"Glaze {i}"].mfo.history) for i in (1, 2)] == [1, 1]
    yield 0.3
    for name in ("Cube 1", "Cube 2"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]


def survive():
    """Undo, kill, new file, deletion and disabling while a fit runs."""
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
    yield from shot("14_killed")

    left = str(folder / "left.blend")
    bpy.ops.wm.save_as_mainfile(filepath=left)
    process = fit(8)
    yield from until(lambda: runtime().fraction > 0, 10)
    bpy.ops.wm.read_homefile(app_template="")
    assert not alive(process)
    yield 1.0
    assert runtime().state == "IDLE"
    assert "was ended as another file was opened" in runtime().sentence
    assert "in the history when left.blend is opened again" in runtime().sentence
    yield from shot("15_left")
    bpy.ops.wm.open_mainfile(filepath=left)
    yield 1.0
    assert "has results that were not saved" in runtime().sentence
    assert str(process.folder) in [e.job_folder for m in bpy.data.materials for e in m.mfo.history]
    yield from shot("16_came_back")
    bpy.ops.wm.read_homefile(app_template="")
    yield 1.0
    yield from show_tab()
    settings()

    process = fit(60)
    yield from until(lambda: runtime().fraction > 0, 10)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    yield 0.5
    assert runtime().state == "RUNNING"
    timers = (running_job._tick, preflight._run, cycles_check._tick)
    addon_utils.disable(addon_id)
    assert not alive(process)
    assert not any(bpy.app.timers.is_registered(timer) for timer in timers)
    yield 1.0  # draws without the panel


def story():
    yield from show_tab()
    yield from check_and_mend()

    process = fit(40)
    yield from until(lambda: runtime().fraction > 0.15, 20)
    assert runtime().state == "RUNNING"
    assert not bpy.ops.mfo.apply.poll()
    assert "MB" not in runtime().detail
    yield from shot("04_running")
    assert bpy.ops.mfo.cancel() == {"FINISHED"}
    asked = time.time()
    yield from until(lambda: runtime().state == "DONE", 10)  # drawing without a graphics card takes a second
    assert (process.folder / "result.json").stat().st_mtime - asked < 1.0
    assert "best values so far" in runtime().sentence
    yield from until(lambda: len(material().mfo.history) == 1, 5)
    yield from shot("05_cancelled")

    fit(1)
    yield from until(lambda: runtime().state == "DONE" and len(material().mfo.history) == 2, 10)
    yield from shot("06_done")
    with over():
        bpy.ops.ed.undo_push(message="before")
    do(bpy.ops.mfo.apply)
    assert roughness() == 0.3125
    yield 0.5
    scroll(12)
    yield from shot("07_applied")
    scroll(-100)
    for _ in range(20):
        with over():
            bpy.ops.ed.undo()
        assert roughness() == 0.5
        with over():
            bpy.ops.ed.redo()
        assert roughness() == 0.3125
        yield 0.02
    yield from look_back()
    do(bpy.ops.mfo.revert)
    assert roughness() == 0.5
    assert not bpy.ops.mfo.toggle.poll()
    yield from waits()
    yield from queue()
    yield from survive()
    print("ms of wall (processor) time:", stopwatch.slowest(), flush=True)
    stall = max(stopwatch.spent)[0]
    assert stall < LONGEST_STALL, f"{stall * 1000:.1f} ms"
    print(f"ALL GOOD, longest stall {stall * 1000:.1f} ms in {len(stopwatch.spent)} calls", flush=True)


steps.take(story())
