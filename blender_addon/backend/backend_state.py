# SPDX-License-Identifier: GPL-3.0-or-later
"""What this Blender knows about its backend: not installed, installing, being tested, ready or broken.

Kept here and not in Blender's data: it is of the computer, not of a file, and undo must not change it. A timer drives
it in windows, `wait` in background mode; `draw` functions only read `current`.
"""

from __future__ import annotations

import atexit
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ..process.backend_python import BackendPythonError
from ..process.background_task import TASK_TICK
from .backend_check import BackendCheck, Verdict, remember, remembered
from .backend_folder import LOG, is_outdated, remove_all
from .backend_install import BackendInstall, InstallOutcome
from .preferences import backend_root, chosen_python, preference

SHOWN_LINES = 8


@dataclass
class BackendState:
    """`name` is UNKNOWN, NOT_INSTALLED, INSTALLING, TESTING, READY or BROKEN; the rest is for the eye."""

    name: str = "UNKNOWN"
    sentence: str = ""
    problems: list[str] = field(default_factory=list)
    python: str = ""
    step: str = ""
    fraction: float = 0.0
    log: list[str] = field(default_factory=list)
    log_file: str = ""
    has_folder: bool = False  # there is something to remove


current = BackendState()
_install: BackendInstall | None = None
_check: BackendCheck | None = None


def look(*, test: bool = True) -> None:
    """Find out which interpreter is chosen and, with `test`, whether it works; starts a process where nobody knows yet.

    What was found good in an earlier session counts until interpreter, packages or extension change.
    """
    if _install is not None:
        return
    _end_check()
    root = backend_root()
    current.has_folder = root.is_dir()
    current.log_file = str(root / LOG) if (root / LOG).is_file() else ""
    current.problems, current.python = [], ""
    try:
        python = chosen_python(bpy.context)
    except BackendPythonError as error:
        given = bool(preference(bpy.context, "backend_python"))
        old = is_outdated(root)
        _show("BROKEN" if given or old else "NOT_INSTALLED", _OUTDATED if old and not given else str(error))
        return
    current.python = str(python)
    known = remembered(root, python)
    if known is not None:
        _show_verdict(known)
    elif test:
        start_test()
    else:
        _show("UNKNOWN", "Not tested yet.")


def start_test() -> None:
    """Ask the chosen interpreter whether it works, even if the answer is known."""
    global _check
    _end_check()
    python = Path(current.python)
    try:
        _check = BackendCheck(python)
    except OSError as error:
        _show("BROKEN", f"{python} cannot be started ({error.strerror or error}).")
        return
    _show("TESTING", "Testing the backend")
    _drive()


def start_install(python: str = "", wheels: str = "") -> None:
    """Install in the background; `python`: what to build on, `wheels`: a folder to install from without network."""
    global _install
    _end_check()
    _install = BackendInstall(backend_root(), python, wheels)
    current.log = []
    current.step, current.fraction, current.log_file = "Looking for a Python", 0.0, ""
    _show("INSTALLING", "Installing the backend")
    _drive()


def cancel_install() -> None:
    """Ask a running installation to stop."""
    if _install is not None:
        _install.cancel()
        current.step = _install.step
        redraw()


def is_installing() -> bool:
    """Whether an installation runs."""
    return _install is not None


def is_cancelling() -> bool:
    """Whether it was asked to stop."""
    return _install is not None and _install.cancelling


def remove() -> list[str]:
    """Delete all that Install made; returns what could not be deleted."""
    _end_check()
    left = remove_all(backend_root())
    current.log = []
    look()
    return left


def step() -> InstallOutcome | None:
    """Look once at what runs; the outcome of an installation that has just ended."""
    global _install, _check
    outcome = None
    if _install is not None and (_install.poll() or _install.outcome is not None):
        current.log, current.step, current.fraction = _install.lines[-SHOWN_LINES:], _install.step, _install.fraction
        outcome = _install.outcome
        if outcome is not None:
            log = str(_install.log)
            _install = None
            look()
            if outcome.status == "failed":
                _show("BROKEN", outcome.sentence)
            current.log_file = log
        redraw()
    if _check is not None and (verdict := _check.poll()) is not None:
        remember(backend_root(), _check.python, verdict)
        _end_check()
        _show_verdict(verdict)
    return outcome


def wait(tell: Callable[[str], None]) -> InstallOutcome | None:
    """Step until nothing runs, telling each new line of the log; returns the outcome of an installation."""
    outcome, told = None, 0
    while _install is not None or _check is not None:
        if _install is not None:
            _install.poll()
            for line in _install.lines[told:]:
                tell(line)
            told = len(_install.lines)
        outcome = step() or outcome
        time.sleep(0.05)
    return outcome


def close() -> None:
    """End whatever runs and forget what was known."""
    global _install, current
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if bpy.app.timers.is_registered(_first_look):
        bpy.app.timers.unregister(_first_look)
    atexit.unregister(close)
    _end_check()
    if _install is not None:
        _install.close()
        _install = None
    current = BackendState()


def register() -> None:
    """Look for the backend once the windows are there; in background mode nobody would see it."""
    atexit.register(close)
    if not bpy.app.background:
        bpy.app.timers.register(_first_look, first_interval=1.0, persistent=True)


def redraw() -> None:
    """Have panel and preferences drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "PREFERENCES", "PROPERTIES"}:
                area.tag_redraw()


_OUTDATED = "The installed backend belongs to another version of Material Fit: install it again."


def _show(name: str, sentence: str) -> None:
    current.name, current.sentence = name, sentence
    redraw()


def _show_verdict(verdict: Verdict) -> None:
    current.problems = list(verdict.problems)
    _show("READY" if verdict.works else "BROKEN", verdict.sentence)


def _end_check() -> None:
    global _check
    if _check is not None:
        _check.close()
        _check = None


def _drive() -> None:
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TASK_TICK, persistent=True)


def _tick() -> float | None:
    step()
    return TASK_TICK if _install is not None or _check is not None else None


def _first_look() -> None:
    if current.name == "UNKNOWN":
        look()
