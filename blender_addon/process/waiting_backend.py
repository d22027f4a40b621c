# SPDX-License-Identifier: GPL-3.0-or-later
"""The one backend that waits, loaded, for the next fit; it fits one job and ends like any other. No bpy here.

It ends by itself after its idle time, and with this Blender.
"""

from __future__ import annotations

import atexit
import contextlib
from collections.abc import Sequence
from pathlib import Path

from .backend_process import BackendProcess

_waiting: BackendProcess | None = None


def prepare(python: Path, seconds: float, blender: Sequence[str] = ()) -> None:
    """Have a backend of this interpreter wait for so long, unless one does; 0 seconds: none is to wait.

    `blender` is the command line of the Blender that evaluates nodes for it.
    """
    global _waiting
    if _waiting is not None and _waiting.is_alive and _waiting.python == python and seconds > 0.0:
        return
    close()
    if seconds > 0.0:
        with contextlib.suppress(OSError):  # the fit itself will say it
            _waiting = BackendProcess(python, blender=blender, wait=seconds)
            atexit.register(close)


def take(python: Path) -> BackendProcess | None:
    """The backend that waits, no longer kept here; None where none of this interpreter does."""
    global _waiting
    if _waiting is None or _waiting.python != python or not _waiting.is_alive:
        close()
        return None
    taken, _waiting = _waiting, None
    atexit.unregister(close)
    return taken


def memory_mb() -> int | None:
    """Megabytes of the backend that waits, 0 while it loads, None where none waits."""
    return _waiting.memory_mb if _waiting is not None and _waiting.is_alive else None


def close() -> None:
    """End it."""
    global _waiting
    atexit.unregister(close)
    if _waiting is not None:
        _waiting.close(0.0)
        _waiting = None
