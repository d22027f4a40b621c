# SPDX-License-Identifier: GPL-3.0-or-later
"""Pythons of this computer that can carry the backend's virtual environment. No bpy here.

Every candidate is started once and asked, because a name proves nothing: launchers exist without the version behind
them, and Debian ships Pythons that cannot make environments. This takes up to seconds; call it from a thread.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..process.backend_python import backend_environment
from ..process.process_group import own_group

OLDEST, NEWEST = (3, 10), (3, 14)  # requires-python of pyproject.toml; a test compares them
# first those that all packages of the lock have wheels for since long
_ORDER = ("3.12", "3.13", "3.11", "3.10", "3.14")
_PATIENCE = 20.0  # seconds for one candidate; a cold start from a slow disk takes a few
_ASK = """
import json, struct, sys
found = {"version": sys.version_info[:3], "bits": 8 * struct.calcsize("P"), "path": sys.executable, "missing": []}
for name in ("venv", "ensurepip"):
    try:
        __import__(name)
    except ImportError:
        found["missing"].append(name)
print(json.dumps(found))
"""


class InterpreterError(Exception):
    """No suitable Python; the message is one sentence for the user."""


@dataclass(frozen=True)
class Interpreter:
    """A Python that answered: its own path, version, and why it is unsuitable (empty if it is not)."""

    path: Path
    version: str
    reason: str = ""


def find_interpreter(chosen: str, own: str = sys.executable) -> Interpreter:
    """The interpreter at `chosen`, or if that is empty the first suitable one found, at last Blender's (`own`).

    Raises
    ------
    InterpreterError
        If the chosen one, or every one, is unsuitable.
    """
    if chosen:
        found = _ask(Path(chosen).expanduser())
        if found is None:
            raise InterpreterError(f"{chosen} is not a Python: choose the program, for example /usr/bin/python3.12.")
        if found.reason:
            raise InterpreterError(f"{chosen} is Python {found.version}, which {found.reason}: choose another one.")
        return found
    refused: list[str] = []
    seen: set[Path] = set()
    for path in [*_candidates(), Path(own)]:
        found = _ask(path)
        if found is None or found.path in seen:
            continue
        seen.add(found.path)
        if not found.reason:
            return found
        refused.append(f"{found.path} ({found.version}) {found.reason}")
    which = f" Found and not suitable: {'; '.join(refused)}." if refused else ""
    raise InterpreterError(
        "No suitable Python was found on this computer: install Python 3.12 from python.org or your system's packages "
        f"(on Debian and Ubuntu: python3-venv), or choose one of the versions 3.10 to 3.14.{which}"
    )


def _ask(path: Path) -> Interpreter | None:
    """What the program at `path` says about itself; None where it does not answer as a Python."""
    if not path.is_file():
        return None
    try:
        told = subprocess.run(
            [str(path), "-I", "-c", _ASK],
            capture_output=True, text=True, timeout=_PATIENCE, env=backend_environment(path.parent), check=True,
            stdin=subprocess.DEVNULL, **own_group(),
        ).stdout  # fmt: skip
        found = json.loads(told.splitlines()[-1])
        version = tuple(found["version"])
        return Interpreter(Path(found["path"]), ".".join(map(str, version)), _reason(version, found))
    except (OSError, subprocess.SubprocessError, ValueError, LookupError, TypeError):
        return None


def _reason(version: tuple[int, ...], found: dict) -> str:
    if not OLDEST <= version[:2] <= NEWEST:
        return "is not one of the versions 3.10 to 3.14"
    if found["bits"] != 64:
        return "is a 32-bit program, and Mitsuba needs 64 bits"
    if sys.platform == "darwin" and platform.machine() != "arm64":
        return "runs on an Intel Mac, for which Mitsuba has no build"
    if found["missing"]:
        return f"cannot make environments ({', '.join(found['missing'])} is missing; Debian: install python3-venv)"
    return ""


def _candidates() -> Iterator[Path]:
    """Places where systems keep Pythons; a program started from the desktop does not see the user's PATH."""
    home = Path.home()
    for version in _ORDER:
        names = [f"python{version}"] if os.name != "nt" else []
        for name in names:
            found = shutil.which(name)
            folders = ["/usr/bin", "/usr/local/bin", "/opt/homebrew/bin"]
            folders.append(f"/Library/Frameworks/Python.framework/Versions/{version}/bin")
            yield from (Path(p) for p in ([found] if found else []))
            yield from (Path(folder) / name for folder in folders)
            yield from sorted((home / ".pyenv" / "versions").glob(f"{version}.*/bin/{name}"))
            yield from sorted((home / ".local" / "share" / "uv" / "python").glob(f"cpython-{version}*/bin/{name}"))
        if os.name == "nt":
            short = version.replace(".", "")
            bases = [
                os.environ.get("LOCALAPPDATA", "") + r"\Programs\Python",
                os.environ.get("PROGRAMFILES", ""),
                "C:\\",
            ]
            yield from (Path(base) / f"Python{short}" / "python.exe" for base in bases)
    for name in ("python3", "python"):
        found = shutil.which(name)
        if found:
            yield Path(found)
