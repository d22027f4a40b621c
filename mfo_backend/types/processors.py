# SPDX-License-Identifier: Apache-2.0
"""How much of the machine this process may take."""

from __future__ import annotations

import os


def processors() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads_wanted() -> int | None:
    """The limit of the environment's `MFO_THREADS`, at least 1, for several processes on one machine; None without."""
    wanted = os.environ.get("MFO_THREADS", "")
    return max(1, int(wanted)) if wanted.isdecimal() else None
