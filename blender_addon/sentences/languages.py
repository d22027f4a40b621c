# SPDX-License-Identifier: GPL-3.0-or-later
"""Every language besides English: a folder with its texts, called by the first part of what Blender calls it."""

from __future__ import annotations

from types import ModuleType

from . import french, german

FOLDERS: dict[str, ModuleType] = {"de": german, "fr": french}
