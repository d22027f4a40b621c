# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder with the backend environments that Install made: which is complete, which may go. No bpy here.

An environment is a folder ``env-<lock>-<number>``, complete once it holds `installed.json`, which is written last. A
new one is made beside the old one, so that a failed install costs nothing.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time
from pathlib import Path

from ..process.backend_python import EXTENSION_ROOT

LOCK = EXTENSION_ROOT / "requirements" / "backend.lock"
MARKER = "installed.json"
LOG = "install.log"
_ABANDONED = 24 * 3600.0  # seconds after which an environment without marker is nobody's any more


def lock_name(lock: Path = LOCK) -> str:
    """Eight letters that stand for the content of the lock file; short, because Windows limits paths."""
    return hashlib.sha256(lock.read_bytes()).hexdigest()[:8]


def python_of(environment: Path) -> Path:
    """The interpreter of a virtual environment."""
    return environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def installed_python(root: Path, lock: Path = LOCK) -> Path | None:
    """The interpreter of the newest complete environment made from this lock file."""
    try:
        found = [e for e in root.glob(f"env-{lock_name(lock)}-*") if (e / MARKER).is_file()]
        newest = max(found, key=lambda e: (e / MARKER).stat().st_mtime, default=None)
    except OSError:
        return None
    return python_of(newest) if newest is not None and python_of(newest).is_file() else None


def is_outdated(root: Path, lock: Path = LOCK) -> bool:
    """Whether there are complete environments, but only of another version's lock file."""
    return installed_python(root, lock) is None and any(root.glob(f"env-*/{MARKER}"))


def new_environment(root: Path, lock: Path = LOCK) -> Path:
    """Make the empty folder of a new environment; two Blenders that install at once get two.

    Raises
    ------
    OSError
        If it cannot be made.
    """
    root.mkdir(parents=True, exist_ok=True)
    number = 1
    while True:
        folder = root / f"env-{lock_name(lock)}-{number}"
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
        else:
            return folder


def complete(environment: Path, about: dict[str, str]) -> None:
    """Mark an environment as complete and drop the older ones and what broken installs left."""
    partial = environment / (MARKER + ".tmp")
    partial.write_text(json.dumps(about, indent=1), "utf-8")
    os.replace(partial, environment / MARKER)
    for other in environment.parent.glob("env-*"):
        abandoned = (other / MARKER).is_file() or time.time() - other.stat().st_mtime > _ABANDONED
        if other != environment and abandoned:
            shutil.rmtree(other, ignore_errors=True)


def remove_all(root: Path) -> list[str]:
    """Delete every environment and the log; returns what could not be deleted."""
    left: list[str] = []

    def keep(_function: object, path: str, _error: object) -> None:
        left.append(path)

    if root.is_dir():
        shutil.rmtree(root, onerror=keep)
    return left
