# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on preferences say: the backend, its Python, and where job folders go."""

import os
import re
import tempfile
from datetime import datetime
from pathlib import Path

import bpy

from ..process.backend_python import backend_python
from .backend_folder import installed_python

IDLE_MINUTES = 5  # a loaded backend waits so long; it holds some 200 MB
# bl_ext.<repository>.material_fit_mfo as an extension, blender_addon when imported by itself
ADDON_ID = (__package__ or "").removesuffix(".backend").removesuffix(".blender_addon")


def preference(context: bpy.types.Context, name: str) -> str:
    """A preference's value, empty where the package runs without being enabled as an add-on."""
    addon = context.preferences.addons.get(ADDON_ID)
    return getattr(addon.preferences, name, "") if addon else ""


def idle_seconds(context: bpy.types.Context) -> float:
    """How long a backend waits, loaded, for the next fit; 0: it does not."""
    addon = context.preferences.addons.get(ADDON_ID)
    return 60.0 * (addon.preferences.idle_minutes if addon else IDLE_MINUTES)


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


def shelf_folder() -> Path:
    """Where it is noted which results are not saved in their files yet. It need not exist."""
    try:
        return Path(bpy.utils.extension_path_user(ADDON_ID, path="shelf", create=False))
    except ValueError:  # not installed as an extension
        return Path(tempfile.gettempdir()) / "material_fit_shelf"


def _default_root() -> str:
    try:
        # empty where Blender cannot make it, which would be the folder that Blender was started in
        made = bpy.utils.extension_path_user(ADDON_ID, path="jobs", create=True)
    except ValueError:  # not installed as an extension
        made = ""
    return made or str(Path(tempfile.gettempdir()) / "material_fit_jobs")
