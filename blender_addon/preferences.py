# SPDX-License-Identifier: GPL-3.0-or-later
"""Add-on preferences: the backend, its Python, and where job folders go."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

import os
import re
import tempfile
from datetime import datetime
from pathlib import Path

import bpy
from bpy.props import StringProperty

from .backend_folder import installed_python
from .backend_python import VARIABLE, backend_python

# bl_ext.<repository>.material_fit_mfo as an extension, blender_addon when imported by itself
ADDON_ID = (__package__ or "").removesuffix(".blender_addon")


def _look_again(_self: object, _context: bpy.types.Context) -> None:
    from . import backend_state  # it imports this module

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

    def draw(self, context: bpy.types.Context) -> None:
        """The state of the backend, the paths, and a line where the variable wins over the first."""
        from .backend_section import draw_setup  # it imports this module

        layout = self.layout
        letters = int((context.region.width / context.preferences.system.ui_scale - 140) / 5.8)
        draw_setup(layout, width=max(16, letters))
        layout.use_property_split = True
        layout.prop(self, "base_python")
        layout.prop(self, "wheels")
        layout.separator()
        layout.prop(self, "backend_python")
        if os.environ.get(VARIABLE):
            layout.label(text=f"{VARIABLE} is set and used instead: {os.environ[VARIABLE]}", icon="INFO")
        layout.prop(self, "job_root")


def preference(context: bpy.types.Context, name: str) -> str:
    """A preference's value, empty where the package runs without being enabled as an add-on."""
    addon = context.preferences.addons.get(ADDON_ID)
    return getattr(addon.preferences, name, "") if addon else ""


def new_job_folder(context: bpy.types.Context, label: str) -> Path:
    """Path of a job folder that does not exist yet, named after the time, `label` and this process.

    Two Blenders that start in the same second must not take the same one: an export replaces an earlier job.
    """
    root = bpy.path.abspath(preference(context, "job_root")) or _default_root()
    plain = re.sub(r"[^\w-]+", "_", label)[:40].strip("_")
    stem = f"{datetime.now():%Y-%m-%d_%H-%M-%S}_{plain}_{os.getpid()}"
    folder, n = Path(root) / stem, 1
    while folder.exists():
        n += 1
        folder = Path(root) / f"{stem}_{n}"
    return folder


def chosen_python(context: bpy.types.Context) -> Path:
    """The interpreter of the backend.

    Raises
    ------
    BackendPythonError
        If there is none.
    """
    return backend_python(bpy.path.abspath(preference(context, "backend_python")), installed_python(backend_root()))


def backend_root() -> Path:
    """Folder of what Install makes; Blender deletes it with the extension. It need not exist."""
    try:
        return Path(bpy.utils.extension_path_user(ADDON_ID, path="backend", create=False))
    except ValueError:  # not installed as an extension
        return Path(bpy.utils.user_resource("DATAFILES"), "material_fit_mfo", "backend")


def _default_root() -> str:
    try:
        return bpy.utils.extension_path_user(ADDON_ID, path="jobs", create=True)
    except ValueError:  # not installed as an extension
        return str(Path(tempfile.gettempdir()) / "material_fit_jobs")


CLASSES = (MFO_AP_preferences,)
