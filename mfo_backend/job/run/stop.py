# SPDX-License-Identifier: Apache-2.0
"""Every way to ask a running job to stop, behind one question."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from ...render.machine.other_process import liveness_of
from ...types.status import Status

POLL_SECONDS = 0.1  # how often cancel file and parent are looked at; a stop is promised within a second
ORPHAN_GRACE = 10.0  # seconds an orphan may take to write its best values
LOADING_GRACE = 0.6  # seconds until a process that has nothing to keep yet ends at once; within the promised second


class StopSignal:
    """Collects requests to stop from a cancel file, a control stream, the death of the parent and signals.

    Parameters
    ----------
    cancel_file
        A path whose existence asks to stop.
    parent
        Id of a process whose end asks to stop.
    control
        File descriptor of a stream of JSON lines; ``{"cmd": "cancel"}`` and its end ask to stop.
    end_process
        Called with the exit code where waiting is no longer right: while a scene is loading, when an orphan does not
        finish, at a second signal.
    """

    def __init__(
        self,
        *,
        cancel_file: Path | None = None,
        parent: int | None = None,
        control: int | None = None,
        end_process: Callable[[int], Any] = os._exit,
        orphan_grace: float = ORPHAN_GRACE,
    ) -> None:
        self.reason = ""
        self._asked = threading.Event()
        self._done = threading.Event()
        self._asked_at = 0.0
        self._orphaned = False
        self._while_loading: Callable[[], None] | None = None
        self._cancel_file = cancel_file
        self._parent_lives = liveness_of(parent) if parent is not None else None
        self._control = control
        self._end_process = end_process
        self._orphan_grace = orphan_grace
        self._signals = 0

    def requested(self) -> bool:
        """Whether to stop; cheap enough for every iteration."""
        return self._asked.is_set()

    def request(self, reason: str, *, orphaned: bool = False) -> None:
        """Ask to stop; only the first reason is kept."""
        if not self._asked.is_set():
            self.reason = reason
            self._asked_at = time.monotonic()
            self._asked.set()
        self._orphaned = self._orphaned or orphaned

    @contextlib.contextmanager
    def watching(self) -> Iterator[StopSignal]:
        """Watch all sources while the block runs; only here are SIGTERM and SIGINT requests instead of ends."""
        wake, woken = socket.socketpair()
        wake.setblocking(False)
        restore = self._install_signals(wake)
        threads = [threading.Thread(target=self._watch, args=(woken,), name="mfo-stop", daemon=True)]
        if self._control is not None:
            threads.append(threading.Thread(target=self._listen, name="mfo-control", daemon=True))
        for thread in threads:
            thread.start()
        try:
            yield self
        finally:
            self._done.set()
            with contextlib.suppress(OSError):
                wake.send(b"\0")
            threads[0].join()
            restore()
            wake.close()
            woken.close()

    def loading(self, last_words: Callable[[], None]) -> None:
        """From now on there is nothing to keep: a request runs `last_words` and ends the process soon after it."""
        self._while_loading = last_words

    def loaded(self) -> None:
        """From now on the fit itself answers `requested` and keeps its best values."""
        self._while_loading = None

    def _watch(self, woken: socket.socket) -> None:
        while not self._done.is_set():
            ready, _, _ = select.select([woken], [], [], POLL_SECONDS)
            if ready:
                self._signals += sum(1 for number in woken.recv(64) if number)
                if self._signals:
                    self.request("a signal asked to stop")
                if self._signals > 1:  # someone insists
                    self._end_process(Status.CANCELLED.exit_code)
            if self._cancel_file is not None and self._cancel_file.exists():
                self.request("the file 'cancel' asked to stop")
            if self._parent_lives is not None and not self._parent_lives():
                self.request("the program that started this job has ended", orphaned=True)
            if self._asked.is_set():
                self._end_if_due(time.monotonic() - self._asked_at)

    def _end_if_due(self, waited: float) -> None:
        last_words = self._while_loading
        if last_words is not None and waited > LOADING_GRACE:
            last_words()
            self._end_process(Status.CANCELLED.exit_code)
        if self._orphaned and waited > self._orphan_grace:
            self._end_process(Status.CANCELLED.exit_code)

    def _listen(self) -> None:
        # os.read, not a buffered file: a thread that dies inside one takes the interpreter's shutdown with it (SIGABRT)
        assert self._control is not None
        unfinished = b""
        with contextlib.suppress(OSError):  # closed under us: the same as its end
            while piece := os.read(self._control, 4096):
                *lines, unfinished = (unfinished + piece).split(b"\n")
                for line in lines:
                    self._obey(line)
        self.request("the program that started this job closed its control stream", orphaned=True)

    def _obey(self, line: bytes) -> None:
        with contextlib.suppress(ValueError):  # a line that is not JSON is not for us
            command = json.loads(line)
            if isinstance(command, dict) and command.get("cmd") == "cancel":
                self.request("a cancel command asked to stop")

    def _install_signals(self, wake: socket.socket) -> Callable[[], None]:
        """Route signals to the watching thread, which sees them even while the main thread is in native code."""
        if threading.current_thread() is not threading.main_thread():
            return lambda: None

        def note(number: int, frame: FrameType | None) -> None:
            self.request("a signal asked to stop")

        names = [name for name in ("SIGTERM", "SIGINT", "SIGBREAK") if hasattr(signal, name)]
        before = {getattr(signal, name): signal.signal(getattr(signal, name), note) for name in names}
        wakeup_before = signal.set_wakeup_fd(wake.fileno(), warn_on_full_buffer=False)

        def restore() -> None:
            signal.set_wakeup_fd(wakeup_before)
            for number, handler in before.items():
                signal.signal(number, handler)

        return restore
