# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of the add-on preferences; what is chosen there is read by `preferences`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import os

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ..process import waiting_backend
from ..process.backend_python import VARIABLE
from ..text_width import ui_scale
from . import backend_state
from .backend_section import draw_setup
from .preferences import ADDON_ID, IDLE_MINUTES

_AROUND, _LEAST_LINE = 140.0, 90.0  # margins of the page and the shortest line, pixels at a scale of 1


def _look_again(_self: object, _context: bpy.types.Context) -> None:
    backend_state.look()


class MFO_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the extension."""

    bl_idname = ADDON_ID

    backend_python: StringProperty(
        name="Backend Python",
        description="A Python of your own that has Mitsuba; empty: the one that Install makes",
        subtype="FILE_PATH",
        update=_look_again,
    )
    base_python: StringProperty(
        name="Install With",
        description="Python 3.10 to 3.14 that carries the installed backend; empty: one is looked for",
        subtype="FILE_PATH",
    )
    wheels: StringProperty(
        name="Wheels",
        description="Folder of downloaded packages to install from without network; empty: download them",
        subtype="DIR_PATH",
    )
    job_root: StringProperty(
        name="Job Folders",
        description="Folder that gets one folder per fit; empty: the user folder of this extension",
        subtype="DIR_PATH",
    )

    idle_minutes: IntProperty(
        name="Keep Ready",
        description="Minutes that a loaded backend waits for the next fit, which then begins at once; 0: none waits",
        default=IDLE_MINUTES,
        min=0,
        max=120,
    )
    when_done: EnumProperty(
        name="When a Fit Ends",
        description="What tells of it besides the panel and the status bar",
        items=(
            ("NOTHING", "Nothing", "Panel and status bar alone"),
            ("SOUND", "Sound", "Two short tones"),
            ("NOTICE", "System Notice", "A notice of the system, by notify-send on Linux and osascript on macOS"),
        ),
    )

    def draw(self, context: bpy.types.Context) -> None:
        """The state of the backend, the paths, and a line where the variable wins over the first."""
        layout = self.layout
        draw_setup(layout, context, width=max(context.region.width / ui_scale(context) - _AROUND, _LEAST_LINE))
        layout.use_property_split = True
        layout.prop(self, "base_python")
        layout.prop(self, "wheels")
        layout.separator()
        layout.prop(self, "backend_python")
        if os.environ.get(VARIABLE):
            layout.label(text=f"{VARIABLE} is set and used instead: {os.environ[VARIABLE]}", icon="INFO")
        layout.prop(self, "job_root")
        layout.prop(self, "idle_minutes")
        layout.prop(self, "when_done")
        held = waiting_backend.memory_mb()
        if held is not None:
            layout.label(text=f"A backend waits and holds {held} MB" if held else "A backend is loading", icon="TIME")


CLASSES = (MFO_AP_preferences,)
