# SPDX-License-Identifier: GPL-3.0-or-later
"""The backend as a child process: start, read its JSON lines, cancel, say in one sentence how it ended. No bpy here.

`poll` never blocks; a timer calls it in windows, a loop in background mode. The only thread here reads a pipe.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from .backend_python import EXTENSION_ROOT, backend_environment
from .process_group import KILL, TERMINATE, own_group, signal_group
from .progress_lines import Event, read_events

LOG = "backend.log"
RESULT, PARTIAL = "result.json", "partial.json"

CANCEL_GRACE = 5.0  # seconds from the cancel command to SIGTERM; the backend promises to need one
TERMINATE_GRACE = 3.0  # seconds from SIGTERM to SIGKILL
PIPE_GRACE = 1.0  # seconds a dead process' pipe may stay open (a grandchild can hold it) before we stop reading
QUEUE_LIMIT = 1000  # events besides progress and preview, of which only the newest is kept

_LAST_EVENTS = ("finished", "failed")
_COALESCED = ("progress", "preview")
_EXIT_SENTENCES = {
    0: "The backend ended without a result",
    1: "The backend failed",
    2: "The backend could not use its input",
    3: "Something the backend needs is not installed",
    4: "Cancelled",
    5: "The result does not match the reference",
}
_EXIT_STATUS = {2: "bad_input", 3: "setup", 4: "cancelled", 5: "different"}


@dataclass(frozen=True)
class Outcome:
    """How a run ended: status code (`docs/reference/job_folder.md`), one sentence, the end of the log if it crashed."""

    status: str
    sentence: str
    log_tail: str = ""


class JobProcess:
    """A running backend that works on one job folder.

    Parameters
    ----------
    python
        Interpreter of the backend.
    folder
        Job folder with request.json; stderr goes to backend.log in it.
    root
        Folder that holds the package `mfo_backend`.

    Raises
    ------
    OSError
        If the log cannot be written or the interpreter cannot be started.
    """

    def __init__(self, python: Path, folder: Path, *, root: Path = EXTENSION_ROOT) -> None:
        self.folder = folder
        self.outcome: Outcome | None = None
        self._lock = threading.Lock()
        self._events: deque[Event] = deque(maxlen=QUEUE_LIMIT)
        self._newest: dict[str, Event] = {}
        self._last: Event | None = None
        self._deadlines: list[tuple[float, int]] = []
        self._cancelled = False
        self._exit_seen: float | None = None
        command = [str(python), "-m", "mfo_backend", "run", str(folder), "--progress", "json", "--control", "stdin"]
        with open(folder / LOG, "wb") as log:
            self._process = subprocess.Popen(
                [*command, "--parent", str(os.getpid())],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                cwd=root,  # not the job folder: `-m` imports from here, and a job may come from a stranger
                env=backend_environment(root),
                **own_group(),
            )
        self._reader = threading.Thread(target=self._read, name="mfo-reader", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Process id, which is also its group's."""
        return self._process.pid

    @property
    def cancelling(self) -> bool:
        """Whether `cancel` was called and the process still runs."""
        return self._cancelled and self.outcome is None

    def poll(self) -> list[Event]:
        """Events since the last call, of progress and preview only the newest; sets `outcome` at the run's end."""
        if self.outcome is None:
            self._escalate()
            self._check_end()
        with self._lock:
            events = [*self._events, *self._newest.values()]
            self._events.clear()
            self._newest.clear()
        return events

    def cancel(self) -> None:
        """Ask the backend to stop and keep its best values; it is terminated and then killed if it does not."""
        if self._cancelled or self.outcome is not None:
            return
        self._cancelled = True
        self._send(b'{"cmd": "cancel"}\n')
        self._stop_after(CANCEL_GRACE)

    def close(self, grace: float = 1.0) -> None:
        """End the process within `grace` seconds (it may still write its best values) and release the pipes."""
        if self.outcome is None:
            self.cancel()
            self._close_stdin()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(grace)
            if self._process.poll() is None:
                signal_group(self.pid, KILL)
                self._process.wait()
            self._reader.join(PIPE_GRACE)
            self._end()

    def _read(self) -> None:
        stdout = self._process.stdout
        assert stdout is not None
        for event in read_events(stdout):
            with self._lock:
                if event["event"] in _COALESCED:
                    self._newest[event["event"]] = event
                else:
                    self._events.append(event)
                if event["event"] in _LAST_EVENTS:
                    self._last = event

    def _check_end(self) -> None:
        if self._process.poll() is None:
            if self._last is not None and not self._deadlines:
                self._stop_after(CANCEL_GRACE)  # it said it was done and hangs in its own shutdown
            return
        self._exit_seen = self._exit_seen or time.monotonic()
        if not self._reader.is_alive() or time.monotonic() - self._exit_seen > PIPE_GRACE:
            self._end()

    def _end(self) -> None:
        self._close_stdin()
        if self._process.stdout is not None and not self._reader.is_alive():
            self._process.stdout.close()
        self.outcome = self._judge(self._process.returncode)

    def _judge(self, code: int) -> Outcome:
        last = self._last
        if last is not None:
            fallback = _EXIT_SENTENCES.get(code, "The backend ended") + "."
            return Outcome(str(last.get("status", "failed")), str(last.get("sentence") or fallback))
        if self._cancelled:
            kept = "only its best values so far were kept" if self._keep_best() else "nothing of this run was kept"
            return Outcome("cancelled", f"Cancelled; the backend did not answer in time, so {kept}.")
        if code < 0:
            name = _signal_name(-code)
            # native code that gets no memory ends in a segmentation fault (Dr.Jit 1.5.0, Embree 3)
            ended = "was killed" if name == "SIGKILL" else "crashed"
            cause = f"The backend {ended} ({name}); the memory may have run out, so try a lower resolution"
        else:
            cause = _EXIT_SENTENCES.get(code, f"The backend ended with the unknown exit code {code}")
        if self._keep_best():
            cause += "; the best values so far are kept and can be applied"
        tail = log_tail(self.folder / LOG)
        reason = next((line.strip() for line in reversed(tail.splitlines()) if line.strip()), "")
        sentence = (
            f"{cause}; its log {self.folder / LOG} ends with: {reason}" if reason else f"{cause}; its log is empty."
        )
        return Outcome(_EXIT_STATUS.get(code, "failed"), sentence, tail)

    def _keep_best(self) -> bool:
        """Make the best values so far of a dead process the result, unless it has written one."""
        result, partial = self.folder / RESULT, self.folder / PARTIAL
        with contextlib.suppress(OSError):
            if partial.is_file() and not result.exists():
                os.replace(partial, result)
                return True
        return False

    def _send(self, line: bytes) -> None:
        stdin = self._process.stdin
        if stdin is not None and not stdin.closed:
            with contextlib.suppress(OSError):  # it is gone already, or never listens
                stdin.write(line)
                stdin.flush()

    def _close_stdin(self) -> None:
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()

    def _stop_after(self, seconds: float) -> None:
        now = time.monotonic()
        self._deadlines = [(now + seconds, TERMINATE), (now + seconds + TERMINATE_GRACE, KILL)]

    def _escalate(self) -> None:
        if self._deadlines and time.monotonic() >= self._deadlines[0][0] and self._process.poll() is None:
            signal_group(self.pid, self._deadlines.pop(0)[1])


def log_tail(path: Path, lines: int = 40) -> str:
    """The last `lines` lines of a text file, empty if it cannot be read."""
    try:
        with open(path, "rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - 20_000))
            return "\n".join(file.read().decode("utf-8", "replace").splitlines()[-lines:])
    except OSError:
        return ""


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
