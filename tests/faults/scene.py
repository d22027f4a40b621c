# SPDX-License-Identifier: Apache-2.0
"""A .blend and a reference picture of it with other values, made once in a folder."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class DemoFiles:
    """`start` is fitted to `reference`, a render of the same scene by Cycles with another material."""

    start: Path
    reference: Path


def environment(**more: str) -> dict[str, str]:
    """This process' environment with the add-on and this Python as its backend."""
    return {**os.environ, "PYTHONPATH": str(ROOT), "MFO_BACKEND_PYTHON": sys.executable, **more}


def in_blender(*words: str | Path, **options: Any) -> subprocess.Popen[str]:
    """Start `in_blender.py` with the bpy module."""
    command = [sys.executable, "-m", "tests.faults.in_blender", *map(str, words)]
    return subprocess.Popen(
        command, cwd=ROOT, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, **options
    )


def headless(*words: str | Path) -> None:
    """Run the add-on's own headless commands."""
    command: Sequence[str] = [sys.executable, "-m", "blender_addon.headless", *map(str, words)]
    subprocess.run(command, cwd=ROOT, env=environment(), check=True, capture_output=True)


def make_demo(folder: Path, size: int = 24) -> DemoFiles:
    """Write the demo's scene and a render of its truth, `size` pixels wide."""
    files = DemoFiles(folder / "start.blend", folder / "reference.exr")
    if not files.reference.exists():
        folder.mkdir(parents=True, exist_ok=True)
        headless("demo-scene", folder, "--size", str(size))
        headless("render", folder / "truth.blend", "--out", files.reference, "--samples", "64")
    return files
