# SPDX-License-Identifier: GPL-3.0-or-later
"""A backend as a child process: its events as they come, commands to it, its end. No bpy here.

Nothing here waits but `close`; the only thread reads a pipe.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import threading
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from .backend_python import EXTENSION_ROOT, backend_environment
from .process_group import KILL, own_group, signal_group
from .progress_lines import Event, read_events

LOG = "backend.log"
PIPE_GRACE = 1.0  # seconds a dead process' pipe may stay open (a grandchild can hold it) before we stop reading
QUEUE_LIMIT = 1000  # events besides progress and preview, of which only the newest is kept

_LAST_EVENTS = ("finished", "failed")
_COALESCED = ("progress", "preview")


class BackendProcess:
    """`mfo run`, on a job folder or waiting for one.

    Parameters
    ----------
    python
        Interpreter of the backend.
    job
        Job folder with request.json; stderr goes to backend.log in it.
    blender
        Command line of the Blender that evaluates nodes while values inside them are fitted.
    wait
        Instead: seconds to wait for a job that `give` names.
    root
        Folder that holds the package `mfo_backend`.

    Raises
    ------
    OSError
        If the log cannot be written or the interpreter cannot be started.
    """

    def __init__(
        self,
        python: Path,
        job: Path | None = None,
        *,
        blender: Sequence[str] = (),
        wait: float = 0.0,
        root: Path = EXTENSION_ROOT,
    ) -> None:
        self.python, self.root = python, root
        self.lock = threading.Lock()
        self.events: deque[Event] = deque(maxlen=QUEUE_LIMIT)
        self.last: Event | None = None  # finished or failed
        self.memory_mb = 0  # of one that waits; 0 while it loads
        self.has_accepted = job is not None
        self._newest: dict[str, Event] = {}
        what = [str(job)] if job is not None else ["--wait", f"{wait:.0f}"]
        command = [str(python), "-m", "mfo_backend", "run", *what, "--progress", "json", "--control", "stdin"]
        if blender:
            command += ["--blender-server", json.dumps(list(blender))]
        with open(job / LOG if job is not None else os.devnull, "wb") as log:
            self.process = subprocess.Popen(
                [*command, "--parent", str(os.getpid())],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                cwd=root,  # not the job folder: `-m` imports from here, and a job may come from a stranger
                env=backend_environment(root),
                **own_group(),
            )
        self.reader = threading.Thread(target=self._read, name="mfo-reader", daemon=True)
        self.reader.start()

    @property
    def is_alive(self) -> bool:
        """Whether it has not ended."""
        return self.process.poll() is None

    def give(self, job: Path) -> None:
        """Name the job to one that waits; it says `accepted`, or has ended before it read this."""
        self.send({"cmd": "run", "job": str(job)})

    def take_events(self) -> list[Event]:
        """Events since the last call, of progress and preview only the newest."""
        with self.lock:
            events = [*self.events, *self._newest.values()]
            self.events.clear()
            self._newest.clear()
        return events

    def send(self, command: dict[str, str]) -> None:
        """Write a line to its stdin; nothing happens where it is gone or does not listen."""
        stdin = self.process.stdin
        if stdin is not None and not stdin.closed:
            with contextlib.suppress(OSError):
                stdin.write(json.dumps(command).encode() + b"\n")
                stdin.flush()

    def close_stdin(self) -> None:
        """Let go of its stdin, at whose end it stops."""
        if self.process.stdin is not None:
            with contextlib.suppress(OSError):
                self.process.stdin.close()

    def release(self) -> None:
        """Close the pipes of a process that has ended."""
        self.close_stdin()
        if self.process.stdout is not None and not self.reader.is_alive():
            self.process.stdout.close()

    def close(self, grace: float) -> None:
        """End it within `grace` seconds after the end of its stdin, and release the pipes."""
        self.close_stdin()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(grace)
        if self.is_alive:
            signal_group(self.process.pid, KILL)
            self.process.wait()
        self.reader.join(PIPE_GRACE)
        self.release()

    def _read(self) -> None:
        stdout = self.process.stdout
        assert stdout is not None
        for event in read_events(stdout):
            name = event["event"]
            with self.lock:
                if name == "waiting":
                    self.memory_mb = int(event.get("memory_mb") or 0)
                elif name == "accepted":
                    self.has_accepted = True
                elif name in _COALESCED:
                    self._newest[name] = event
                else:
                    self.events.append(event)
                if name in _LAST_EVENTS:
                    self.last = event
