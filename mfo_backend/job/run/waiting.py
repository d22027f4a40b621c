# SPDX-License-Identifier: Apache-2.0
"""A process that has everything loaded and waits for its one job: the start of a fit without the start of Python.

It fits a single job and ends, so that no job can see anything of another.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TextIO

from ...render.machine.other_process import liveness_of
from ...types.status import Status

LOG = "backend.log"  # in the job's folder; the add-on reads it
_LOOK_SECONDS = 0.5  # between two looks at the clock and at the parent


def wait_for_job(
    control: int,
    stream: TextIO | None,
    *,
    idle_seconds: float,
    parent: int | None,
    prepare: Callable[[], object],
    end_process: Callable[[int], NoReturn] = os._exit,
) -> Path:
    """Run `prepare`, wait for a line ``{"cmd": "run", "job": FOLDER}`` and return the folder.

    `stream` gets the events `waiting`, with the megabytes that the process holds, and `accepted`. From then on stderr
    goes into `LOG` in the folder. After `idle_seconds` without a job, at the end of `control` (a file descriptor), or
    when the process `parent` is gone, this process ends with exit code 0.
    """
    given = threading.Event()
    threading.Thread(target=_watch, args=(given, idle_seconds, parent, end_process), daemon=True).start()
    prepare()
    _say(stream, {"event": "waiting", "memory_mb": _memory_mb()})
    folder = _next_job(control)
    if folder is None:
        end_process(Status.CONVERGED.exit_code)
    given.set()
    _log_into(folder)
    _say(stream, {"event": "accepted"})
    return folder


def _watch(given: threading.Event, seconds: float, parent: int | None, end_process: Callable[[int], Any]) -> None:
    lives = liveness_of(parent) if parent is not None else lambda: True
    end = time.monotonic() + seconds
    while not given.wait(_LOOK_SECONDS):
        if time.monotonic() > end or not lives():
            end_process(Status.CONVERGED.exit_code)


def _next_job(control: int) -> Path | None:
    while (line := _line(control)) is not None:
        folder = _job_of(line)
        if folder is not None:  # other lines are not for us
            return folder
    return None


def _line(control: int) -> bytes | None:
    """The next line, None at the end; not one byte more is taken, since what follows is for the job's own listener."""
    line = b""
    while piece := os.read(control, 1):
        if piece == b"\n":
            return line
        line += piece
    return None


def _job_of(line: bytes) -> Path | None:
    try:
        command = json.loads(line)
    except ValueError:
        return None
    if not isinstance(command, dict) or command.get("cmd") != "run" or not isinstance(command.get("job"), str):
        return None
    return Path(command["job"])


def _log_into(folder: Path) -> None:
    """Let file descriptor 2 write into the job's log; where it cannot be written the job itself will say why."""
    try:
        log = os.open(folder / LOG, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    except OSError:
        return
    os.dup2(log, 2)
    os.close(log)


def _say(stream: TextIO | None, event: dict[str, Any]) -> None:
    if stream is not None:
        stream.write(json.dumps(event) + "\n")
        stream.flush()


def _memory_mb() -> int | None:
    """Resident megabytes; None where the system does not tell as Linux does."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return None
    return round(pages * os.sysconf("SC_PAGE_SIZE") / 1e6)
