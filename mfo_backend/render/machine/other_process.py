# SPDX-License-Identifier: Apache-2.0
"""Whether another process still lives."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path


def liveness_of(pid: int) -> Callable[[], bool]:
    """A function that says whether process `pid` still lives.

    The number of a parent that died may be used again; for our own parent the change of `getppid` is free of that.
    """
    if sys.platform == "win32":
        return _windows_liveness(pid)
    if os.getppid() == pid:
        return lambda: os.getppid() == pid

    def lives() -> bool:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        except PermissionError:  # it lives and belongs to someone else
            return True
        return not _is_zombie(pid)

    return lives


def _is_zombie(pid: int) -> bool:
    # of an orphan until process 1 asks for it, which in many containers takes long or never happens
    try:
        state = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0]  # proc(5)
    except (OSError, IndexError):  # not Linux
        return False
    return state == b"Z"


def _windows_liveness(pid: int) -> Callable[[], bool]:
    # os.kill(pid, 0) would send Ctrl+C on Windows; the open handle also keeps the number from being used again
    import ctypes

    synchronize, still_running = 0x00100000, 0x00000102  # SYNCHRONIZE, WAIT_TIMEOUT (winnt.h, winbase.h)
    kernel = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
    kernel.OpenProcess.restype = ctypes.c_void_p
    kernel.WaitForSingleObject.argtypes = (ctypes.c_void_p, ctypes.c_uint32)
    handle = kernel.OpenProcess(synchronize, False, pid)
    return lambda: bool(handle) and kernel.WaitForSingleObject(handle, 0) == still_running
