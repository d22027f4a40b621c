# SPDX-License-Identifier: Apache-2.0
"""Take the steps of a walk through Blender's windows, one after another, and quit; and what walks look at."""

import sys
import time
import traceback

import bpy

FIRST_SECONDS = 2.0  # until the windows are drawn


def take(steps):
    """Each step is the seconds to wait before the next; an error is printed, and ends the walk."""

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

    bpy.app.timers.register(tick, first_interval=FIRST_SECONDS, persistent=True)


def until(condition, seconds, look=0.05):
    """Wait for a condition, looked at after so many seconds each."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds} s, state {runtime().state}: {runtime().sentence}"
        yield look


def over():
    """With the first window's 3D view, as where its buttons are pressed."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def runtime():
    """What the add-on knows of the running fit."""
    return bpy.context.window_manager.mfo_runtime


def material():
    """The material that is fitted."""
    return bpy.data.objects["Cube"].active_material


def roughness():
    """The value that the fake backend recovers."""
    return next(n for n in material().node_tree.nodes if n.type == "BSDF_PRINCIPLED").inputs["Roughness"].default_value


def plain_picture():
    """A small picture, quick to render, under the plain view."""
    render = bpy.context.scene.render
    render.engine = "CYCLES"
    bpy.context.scene.cycles.samples = 1
    render.resolution_x, render.resolution_y = 96, 64
    bpy.context.scene.view_settings.view_transform = "Standard"
