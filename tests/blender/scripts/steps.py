# SPDX-License-Identifier: Apache-2.0
"""Take the steps of a walk through Blender's windows, one after another, and quit."""

import sys
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
