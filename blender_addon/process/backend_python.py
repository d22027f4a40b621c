# SPDX-License-Identifier: GPL-3.0-or-later
"""Which Python runs the backend, and in which environment. No bpy here."""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "MFO_BACKEND_PYTHON"
EXTENSION_ROOT = Path(__file__).resolve().parents[2]
# Blender and launchers set these for their own Python; in another interpreter they break its start or its packages
_FOREIGN = ("VIRTUAL_ENV", "LD_PRELOAD", "DYLD_INSERT_LIBRARIES", "__PYVENV_LAUNCHER__")


class BackendPythonError(Exception):
    """No usable interpreter; the message is one sentence for the user."""


def backend_python(preference: str, installed: Path | None = None) -> Path:
    """The interpreter of the backend: the variable MFO_BACKEND_PYTHON, else `preference`, else what is `installed`.

    Raises
    ------
    BackendPythonError
        If neither is given or the one given is not a program.
    """
    given, origin = os.environ.get(VARIABLE, "").strip(), f"variable {VARIABLE}"
    if not given:
        given, origin = preference.strip(), "add-on preference Backend Python"
    if not given and installed is not None:
        return installed
    if not given:
        raise BackendPythonError(
            "The backend Python is missing: press Install in the add-on preferences, or choose a Python that has "
            f"Mitsuba there (Backend Python) or in the variable {VARIABLE}."
        )
    path = Path(given).expanduser()
    # never resolve(): python of a virtual environment is a link, and its place says which packages it has
    if not path.is_file() or not os.access(path, os.X_OK):
        raise BackendPythonError(
            f"The backend Python is missing: {given} ({origin}) is not a program; choose the Python that has Mitsuba "
            "installed."
        )
    return path.absolute()


def backend_environment(root: Path) -> dict[str, str]:
    """This process' environment without what belongs to Blender's Python, with `root` on PYTHONPATH."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON") and k not in _FOREIGN}
    return kept | {
        "PYTHONPATH": str(root),
        "PYTHONNOUSERSITE": "1",
        "PYTHONUTF8": "1",
        "PYTHONUNBUFFERED": "1",
        "PYTHONDONTWRITEBYTECODE": "1",  # the folder of an extension is not ours to write into
    }
