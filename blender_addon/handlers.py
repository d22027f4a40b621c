# SPDX-License-Identifier: GPL-3.0-or-later
"""What must happen when Blender opens another file."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from . import running_job


@persistent
def _before_load(*_args: object) -> None:
    running_job.close()  # the objects and materials it works on go away


@persistent
def _after_load(*_args: object) -> None:
    running_job.reset()  # the window manager comes out of the file, with the state of another day


def register() -> None:
    """Watch for files being opened."""
    bpy.app.handlers.load_pre.append(_before_load)
    bpy.app.handlers.load_post.append(_after_load)


def unregister() -> None:
    """Stop watching."""
    bpy.app.handlers.load_post.remove(_after_load)
    bpy.app.handlers.load_pre.remove(_before_load)
