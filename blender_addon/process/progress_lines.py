# SPDX-License-Identifier: GPL-3.0-or-later
"""The backend's stdout as events: one JSON object a line, anything else is somebody's print. No bpy here."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from typing import IO, Any

Event = dict[str, Any]
LINE_LIMIT = 1 << 20  # bytes; a longer line is no event of ours


def read_events(stream: IO[bytes]) -> Iterator[Event]:
    """The events of a stream until its end; NaN and infinity, which JSON does not know, are None."""
    for line in _lines(stream):
        try:
            event = json.loads(line, parse_constant=lambda _: None)
        except (ValueError, RecursionError):
            continue  # a library printed something, or a line was cut by the process' death
        if isinstance(event, dict) and isinstance(event.get("event"), str):
            yield event


def _lines(stream: IO[bytes]) -> Iterator[bytes]:
    """Complete lines of at most LINE_LIMIT bytes; the rest of a longer one is skipped."""
    skipping = False
    with contextlib.suppress(OSError, ValueError):  # the pipe was closed under us
        while line := stream.readline(LINE_LIMIT):
            if not skipping and line.endswith(b"\n"):
                yield line
            skipping = not line.endswith(b"\n")
