# SPDX-License-Identifier: Apache-2.0
"""Where this user's caches lie, and how large the one of compiled kernels may grow."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from pathlib import Path

KERNEL_LIMIT = "256M"  # a fit has some 25 kernels, about half a megabyte; Dr.Jit's own limit is a gigabyte
_STALE_SECONDS = 24 * 3600.0  # a kernel is written in far less


def cache_folder() -> Path:
    """The user's cache folder of Material Fit, which may not exist yet; `MFO_CACHE_DIR` overrides it."""
    chosen = os.environ.get("MFO_CACHE_DIR")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "material-fit"


def use_kernel_cache() -> None:
    """Have Dr.Jit keep compiled kernels in a folder of ours; to be called before drjit is imported.

    Above `KERNEL_LIMIT` Dr.Jit 1.5 deletes those that were not used for longest: at its start, once an hour, by a stamp
    file. Where two processes find the stamp missing or an hour old at the same instant, both may delete, and as neither
    counts what the other has deleted, more goes than must, always the oldest first; what is missed is compiled again.
    `DRJIT_CACHE_DIR` and `DRJIT_CACHE_MAXSIZE` override both.
    """
    os.environ.setdefault("DRJIT_CACHE_MAXSIZE", KERNEL_LIMIT)
    if not os.environ.get("DRJIT_CACHE_DIR"):
        with contextlib.suppress(RuntimeError):  # a user without a home
            os.environ["DRJIT_CACHE_DIR"] = str(cache_folder() / "kernels")
    _remove_unfinished(Path(os.environ.get("DRJIT_CACHE_DIR") or os.devnull))


def _remove_unfinished(folder: Path) -> None:
    """Remove what killed processes have left half written, which Dr.Jit never looks at."""
    with contextlib.suppress(OSError):
        for path in folder.glob("*.tmp"):
            if time.time() - path.stat().st_mtime > _STALE_SECONDS:
                path.unlink(missing_ok=True)
