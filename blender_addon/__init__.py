# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender side: export a job, run the backend beside Blender, write the recovered values onto the material."""

from __future__ import annotations

import atexit

import bpy

from . import panel, properties, translations
from .backend import backend_state, preferences_page
from .check import preflight
from .operators import CLASSES as OPERATORS
from .operators import part
from .panel import menu, thumbnails
from .pictures import comparison, overlay, previews
from .process import waiting_backend
from .running import cycles_check, handlers, live, notice, running_export, running_job
from .versions import is_module

CLASSES = (*properties.CLASSES, *preferences_page.CLASSES, *OPERATORS, *panel.CLASSES)


def register() -> None:
    """Add the classes and properties of the extension to Blender."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    part.define_steps()
    properties.attach()
    previews.register()
    menu.register()
    handlers.register()
    translations.register()
    backend_state.register()
    if is_module():
        atexit.register(unregister)  # what is still registered at its end crashes bpy 4.2 and stops bpy 4.5


def unregister() -> None:
    """Take everything `register` added away again; a running fit is stopped first."""
    atexit.unregister(unregister)
    live.close()
    running_export.close()
    running_job.close_for_disable()
    notice.close()
    waiting_backend.close()
    backend_state.close()
    cycles_check.close()
    handlers.unregister()
    preflight.reset()
    comparison.forget()
    overlay.forget()
    thumbnails.close()
    menu.unregister()
    translations.unregister()
    previews.unregister()
    properties.detach()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
