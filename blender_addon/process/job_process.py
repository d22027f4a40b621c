# SPDX-License-Identifier: GPL-3.0-or-later
"""A job in a backend process: start, cancel, say in one sentence how it ended. No bpy here.

`poll` never blocks; a timer calls it in windows, a loop in background mode.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .backend_process import LOG, PIPE_GRACE, BackendProcess
from .backend_python import EXTENSION_ROOT
from .process_group import KILL, TERMINATE, signal_group
from .progress_lines import Event

RESULT, PARTIAL, COPY = "result.json", "partial.json", "graph/scene.blend"

# seconds from the cancel command to SIGTERM. The backend stops fitting within one; the pictures of the values that it
# keeps take 7 to 9 processor seconds for 1920 x 1080, 20 on cores that four others share (docs/notebook/panel.md)
CANCEL_GRACE = 60.0
EXIT_GRACE = 5.0  # from its last event
TERMINATE_GRACE = 3.0  # seconds from SIGTERM to SIGKILL

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
    blender
        Command line of the Blender that evaluates nodes while values inside them are fitted.
    root
        Folder that holds the package `mfo_backend`.
    waiting
        A backend that waits for a job, and gets this one; where it has ended meanwhile another is started.

    Raises
    ------
    OSError
        If the log cannot be written or the interpreter cannot be started.
    """

    def __init__(
        self,
        python: Path,
        folder: Path,
        *,
        blender: Sequence[str] = (),
        root: Path = EXTENSION_ROOT,
        waiting: BackendProcess | None = None,
    ) -> None:
        self.folder = folder
        self.outcome: Outcome | None = None
        self._deadlines: list[tuple[float, int]] = []
        self._cancelled = False
        self._exit_seen: float | None = None
        self._blender = tuple(blender)
        if waiting is not None:
            waiting.give(folder)
        self.backend = waiting or BackendProcess(python, folder, blender=self._blender, root=root)

    @property
    def pid(self) -> int:
        """Process id, which is also its group's."""
        return self.backend.process.pid

    @property
    def cancelling(self) -> bool:
        """Whether `cancel` was called and the process still runs."""
        return self._cancelled and self.outcome is None

    def poll(self) -> list[Event]:
        """Events since the last call, of progress and preview only the newest; sets `outcome` at the run's end."""
        if self.outcome is None:
            self._escalate()
            self._check_end()
        return self.backend.take_events()

    def cancel(self) -> None:
        """Ask the backend to stop and keep its best values; it is terminated and then killed if it does not."""
        if self._cancelled or self.outcome is not None:
            return
        self._cancelled = True
        self.backend.send({"cmd": "cancel"})
        self._stop_after(CANCEL_GRACE)

    def close(self, grace: float = 1.0) -> None:
        """End the process within `grace` seconds (it may still write its best values) and release the pipes."""
        if self.outcome is None:
            self.cancel()
            self.backend.close(grace)
            self._end()

    def _check_end(self) -> None:
        if self.backend.is_alive:
            if self.backend.last is not None and not self._deadlines:
                self._stop_after(EXIT_GRACE)  # it said it was done and hangs in its own shutdown
            return
        self._exit_seen = self._exit_seen or time.monotonic()
        if self.backend.reader.is_alive() and time.monotonic() - self._exit_seen <= PIPE_GRACE:
            return
        if self.backend.has_accepted or self._cancelled:
            self._end()
        else:
            self._start_anew()

    def _start_anew(self) -> None:
        """The one that waited has ended before it took the job."""
        self.backend.release()
        self._exit_seen = None
        try:
            self.backend = BackendProcess(
                self.backend.python, self.folder, blender=self._blender, root=self.backend.root
            )
        except OSError as error:
            sentence = f"The backend could not be started with {self.backend.python} ({error.strerror or error})."
            self.outcome = Outcome("failed", sentence)

    def _end(self) -> None:
        self.backend.release()
        with contextlib.suppress(OSError):  # a whole .blend, which only a running fit has a use for
            (self.folder / COPY).unlink()
        self.outcome = self._judge(self.backend.process.returncode)

    def _judge(self, code: int) -> Outcome:
        last = self.backend.last
        if last is not None:
            fallback = _EXIT_SENTENCES.get(code, "The backend ended") + "."
            return Outcome(str(last.get("status", "failed")), str(last.get("sentence") or fallback))
        if self._cancelled:
            kept = "only its best values so far were kept" if keep_best(self.folder) else "nothing of this run was kept"
            return Outcome("cancelled", f"Cancelled; the backend did not answer in time, so {kept}.")
        if code < 0:
            name = _signal_name(-code)
            # native code that gets no memory ends in a segmentation fault (Dr.Jit 1.5.0, Embree 3)
            ended = "was killed" if name == "SIGKILL" else "crashed"
            cause = f"The backend {ended} ({name}); the memory may have run out, so try a lower resolution"
        else:
            cause = _EXIT_SENTENCES.get(code, f"The backend ended with the unknown exit code {code}")
        if keep_best(self.folder):
            cause += "; the best values so far are kept and can be applied"
        tail = log_tail(self.folder / LOG)
        reason = next((line.strip() for line in reversed(tail.splitlines()) if line.strip()), "")
        sentence = (
            f"{cause}; its log {self.folder / LOG} ends with: {reason}" if reason else f"{cause}; its log is empty."
        )
        return Outcome(_EXIT_STATUS.get(code, "failed"), sentence, tail)

    def _stop_after(self, seconds: float) -> None:
        now = time.monotonic()
        self._deadlines = [(now + seconds, TERMINATE), (now + seconds + TERMINATE_GRACE, KILL)]

    def _escalate(self) -> None:
        if self._deadlines and time.monotonic() >= self._deadlines[0][0] and self.backend.is_alive:
            signal_group(self.pid, self._deadlines.pop(0)[1])


def keep_best(folder: Path) -> bool:
    """Make the best values so far of a process that has ended the result, unless it has written one."""
    result, partial = folder / RESULT, folder / PARTIAL
    with contextlib.suppress(OSError):
        if partial.is_file() and not result.exists():
            os.replace(partial, result)
            return True
    return False


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
