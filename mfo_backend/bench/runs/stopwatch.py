# SPDX-License-Identifier: Apache-2.0
"""Where a fit's time goes, by looking at its thread's stack now and then.

Dr.Jit works late: a kernel runs where its result is first needed, so its time is booked where it is waited for.
"""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

PERIOD = 0.004  # seconds between two looks, each some 5 microseconds
PARTS = ("record", "render", "jacobian", "metric", "solve", "files", "other")
_PACKAGE = str(Path(__file__).parents[2])
# the innermost frame in one of these files or folders of the package decides
_PLACES = {
    "render/paths/record_paths.py": "record",
    "render/paths/recorded_background.py": "record",
    "render/paths/proposal.py": "record",
    "render/paths/recorded_jacobian.py": "jacobian",
    "render/paths/recorded_paths.py": "jacobian",
    "render/": "render",
    "material/": "render",
    "metrics/": "metric",
    "fit/squares/residuals.py": "metric",
    "fit/judge/region.py": "metric",
    "solve/": "solve",
    "scene/": "files",
}


class Stopwatch:
    """Seconds by part, in `parts`, once the block of `watching` is left."""

    def __init__(self) -> None:
        self.parts: dict[str, float] = {}
        self._seen: Counter[str] = Counter()
        self._done = threading.Event()

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Look at the calling thread while the block runs."""
        watched, began = threading.get_ident(), time.monotonic()
        looker = threading.Thread(target=self._look, args=(watched,), name="mfo-stopwatch", daemon=True)
        looker.start()
        try:
            yield
        finally:
            self._done.set()
            looker.join()
            seconds, looks = time.monotonic() - began, max(sum(self._seen.values()), 1)
            self.parts = {part: seconds * self._seen[part] / looks for part in PARTS if self._seen[part]}

    def _look(self, thread: int) -> None:
        while not self._done.wait(PERIOD):
            frame = sys._current_frames().get(thread)
            self._seen[part_of(frame)] += 1


def part_of(frame: FrameType | None) -> str:
    """The part that the innermost known frame of a stack belongs to."""
    while frame is not None:
        name = frame.f_code.co_filename
        if name.startswith(_PACKAGE):
            place = name[len(_PACKAGE) + 1 :].replace("\\", "/")
            for start, part in _PLACES.items():
                if place.startswith(start):
                    return part
        frame = frame.f_back
    return "other"
