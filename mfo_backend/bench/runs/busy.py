# SPDX-License-Identifier: Apache-2.0
"""How much of the processors this and other programs use: seconds from a busy machine are not comparable."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

_STAT = Path("/proc/stat")


@dataclass(frozen=True)
class BusyMark:
    """A moment: seconds on the clock, of this process, and of all programs on all processors (None: not Linux)."""

    clock: float
    own: float
    all: float | None

    @classmethod
    def now(cls) -> BusyMark:
        """This moment."""
        return cls(time.monotonic(), time.process_time(), _busy_seconds())

    def own_seconds(self) -> float:
        """Processor seconds that this process has used since, on all its threads."""
        return time.process_time() - self.own

    def others(self) -> float | None:
        """Share of all processors that other programs have used since."""
        now = BusyMark.now()
        wall = (now.clock - self.clock) * (os.cpu_count() or 1)
        if now.all is None or self.all is None or wall <= 0.0:
            return None
        return min(max((now.all - self.all - (now.own - self.own)) / wall, 0.0), 1.0)


def _busy_seconds() -> float | None:
    try:
        first = _STAT.read_text("ascii").split("\n", 1)[0].split()
        user, nice, system, _, _, irq, softirq = (int(field) for field in first[1:8])
    except (OSError, ValueError):
        return None
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")
