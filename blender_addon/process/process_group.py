# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes in a group of their own, so that what they start ends with them; who lives. No bpy here."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

TERMINATE = signal.SIGTERM
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)  # Windows has no SIGKILL; taskkill /F is one anyway


def own_group() -> dict[str, Any]:
    """Arguments of `subprocess.Popen` that make a group (and on Windows no window)."""
    if os.name == "nt":
        return {"creationflags": subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def signal_group(pid: int, number: int) -> None:
    """Signal the group that process `pid` leads; nothing happens where it is gone."""
    with contextlib.suppress(OSError):
        if os.name == "nt":
            subprocess.run(["taskkill", "/T", "/F", "/PID", str(pid)], capture_output=True, check=False)
        else:
            os.killpg(pid, number)


def process_lives(pid: int) -> bool:
    """Whether there is a process of this id, zombies apart; always so on Windows, where asking would end it."""
    if os.name == "nt":
        return True
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return not _is_zombie(pid)


def _is_zombie(pid: int) -> bool:
    # of an orphan until process 1 asks for it, which in many containers takes long or never happens
    try:
        state = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0]  # proc(5)
    except (OSError, IndexError):  # not Linux
        return False
    return state == b"Z"
