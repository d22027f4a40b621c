# SPDX-License-Identifier: Apache-2.0
"""Go through the states of the backend set-up in windows: not installed, installing, cancelled, broken, removed.

A tiny wheel stands in for Mitsuba, so that the environment that is made cannot run a fit. Pictures of the screen go to
the folder MFO_SCREENSHOTS, where ImageMagick's `import` can take them.
"""

import importlib
import os
import subprocess
import sys
import time
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import steps

addon_id, wheels, lock, python = sys.argv[sys.argv.index("--") + 1 :]
state = importlib.import_module(f"{addon_id}.blender_addon.backend.backend_state")
section = importlib.import_module(f"{addon_id}.blender_addon.backend.backend_section")
install = importlib.import_module(f"{addon_id}.blender_addon.backend.backend_install")
LONGEST_STALL = 0.05  # seconds
spent: list[float] = []
bpy.context.preferences.view.show_splash = False
importlib.import_module("addon_utils").enable(addon_id, default_set=True)  # --addons enables it without preferences
install.BackendInstall.__init__.__defaults__ = ("", "", Path(lock))
state.installed_python = lambda root: None


def timed(function):
    def run(*arguments, **named):
        began = time.perf_counter()
        try:
            return function(*arguments, **named)
        finally:
            spent.append(time.perf_counter() - began)

    return run


state.step = timed(state.step)
section.draw_setup = timed(section.draw_setup)


def shot(name, draws=12):
    if "MFO_SCREENSHOTS" in os.environ:
        for _ in range(draws):  # panels slide open in steps, one with each draw
            state.redraw()
            yield 0.2
        subprocess.run(["import", "-window", "root", os.path.join(os.environ["MFO_SCREENSHOTS"], name + ".png")])


def until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds} s: {state.current}"
        yield 0.05


def show_panel():
    screen = bpy.context.window_manager.windows[0].screen
    area = next(a for a in screen.areas if a.type == "VIEW_3D")
    area.spaces.active.show_region_ui = True
    yield 0.5
    next(r for r in area.regions if r.type == "UI").active_panel_category = "Material Fit"
    area.tag_redraw()
    yield 1.5


def show_preferences():
    bpy.data.window_managers[0].addon_search = "Material Fit"
    bpy.ops.preferences.addon_expand(module=addon_id)
    bpy.ops.screen.userpref_show(section="ADDONS")
    yield 1.5


def preferences():
    return bpy.context.preferences.addons[addon_id].preferences


def start():
    preferences().wheels, preferences().base_python = wheels, python
    assert bpy.ops.mfo.install_backend() == {"FINISHED"}
    assert not bpy.ops.mfo.install_backend.poll()


def story():
    yield from show_panel()
    yield from until(lambda: state.current.name == "NOT_INSTALLED", 10)
    yield from shot("setup_1_not_installed")
    start()
    assert state.current.name == "INSTALLING"
    yield from until(lambda: state.current.step == "Making the environment", 30)
    yield 0.5
    yield from shot("setup_2_installing", draws=1)
    assert bpy.ops.mfo.cancel_install() == {"FINISHED"}
    yield from until(lambda: state.current.name == "NOT_INSTALLED", 20)
    assert not list(state.backend_root().glob("env-*"))
    start()
    yield from until(lambda: state.current.name not in {"INSTALLING", "TESTING"}, 120)
    # complete, but nothing in it that a fit needs: say so, offer to install again and to remove it
    assert list(state.backend_root().glob("env-*/installed.json"))
    preferences().backend_python = str(next(state.backend_root().glob("env-*/bin/python")))
    yield from until(lambda: state.current.name == "BROKEN", 30)
    assert any("lacks mitsuba, drjit, numpy" in problem for problem in state.current.problems), state.current
    assert not bpy.ops.mfo.fit.poll()
    yield 0.5
    yield from shot("setup_3_broken")
    yield from show_preferences()
    yield from shot("setup_4_preferences")
    preferences().backend_python = ""
    assert bpy.ops.mfo.remove_backend() == {"FINISHED"}
    assert not state.backend_root().exists()
    assert state.current.name == "NOT_INSTALLED"
    yield 0.5
    stall = max(spent)
    assert stall < LONGEST_STALL, f"{stall * 1000:.1f} ms"
    assert not {"mitsuba", "drjit", "OpenEXR", "pip"} & set(sys.modules)
    print(f"ALL GOOD, longest stall {stall * 1000:.1f} ms in {len(spent)} calls", flush=True)


steps.take(story())
