# SPDX-License-Identifier: GPL-3.0-or-later
"""How to start this very Blender again, program or module."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

from ..versions import is_module

SERVER = "probe.server"  # the module that evaluates nodes


def own_blender(module: str, arguments: list[str]) -> list[str]:
    """The command line that runs a module of this package, ``"probe.server"``, in a Blender of this version."""
    if is_module():
        return [sys.executable, "-m", f"blender_addon.{module}", *arguments]
    script = Path(__file__).resolve().parent.parent.joinpath(*module.split(".")).with_suffix(".py")
    options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python", str(script), "--"]
    return [bpy.app.binary_path, *options, *arguments]
