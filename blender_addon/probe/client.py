# SPDX-License-Identifier: GPL-3.0-or-later
"""The side that asks: a copy of the file, a second Blender on it, one answer for each request."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import subprocess
import threading
import time
from typing import Any

from ..process.backend_python import EXTENSION_ROOT
from ..process.background_task import environment_for
from ..process.job_process import log_tail
from ..process.own_blender import own_blender
from ..process.process_group import KILL, own_group, signal_group
from ..process.saved_file import save_copy
from ..process.temporary_folder import make_folder

# a surface of 1024 texels takes up to 7 s of one core, a sky of 1024 pixels 5; a big file on a slow machine far more
ANSWER_SECONDS = 600.0  # the second Blender may take for the opening of the file, or for an answer
MORE_SECONDS = 120.0  # and for each further thing that a request asks for
END_SECONDS = 2.0  # the second Blender may take to end when nobody asks any more


class ProbeError(Exception):
    """The second Blender cannot answer; the message is one sentence for the user."""


class Probe:
    """A second Blender on a copy of the file as it is now; it starts at once and is waited for at the first request.

    Use it in a `with` block: at its end the process and its files are gone.

    Raises
    ------
    ProbeError
        If the copy cannot be written or no Blender can be started.
    """

    def __init__(self) -> None:
        self.folder = make_folder("probe")
        self._log = self.folder / "probe.log"
        # from the first, which says that the file is open; None: the process has ended
        self._answers: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._ready = False
        self._asked_at = time.monotonic()
        try:
            copy = self.folder / "scene.blend"
            save_copy(copy)
            # its own temporary files go with the folder, also when it is killed
            environment = environment_for(EXTENSION_ROOT) | dict.fromkeys(("TMPDIR", "TEMP"), str(self.folder))
            words = own_blender("probe.server", [str(copy), "--parent", str(os.getpid())])
            with self._log.open("wb") as log:
                self._process = subprocess.Popen(
                    words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True, encoding="utf-8",
                    env=environment, cwd=self.folder, **own_group(),
                )  # fmt: skip
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise ProbeError(
                f"A second Blender, which evaluates nodes, could not be started on a copy of the file "
                f"({error.strerror or error}): free some space, or save the file under another name."
            ) from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """The second Blender's process."""
        return self._process.pid

    def ask(self, command: str, **words: Any) -> dict[str, Any]:
        """The answer to a request, as JSON values.

        Raises
        ------
        ProbeError
            With the sentence of the second Blender, or the end of its log where it died.
        """
        self.send(command, **words)
        return self.receive()

    def send(self, command: str, **words: Any) -> None:
        """Send a request without waiting; answers come in the order of the requests."""
        assert self._process.stdin is not None
        self._asked_at = time.monotonic()
        with contextlib.suppress(OSError):  # a process that is gone is told by what it does not answer
            self._process.stdin.write(json.dumps({"command": command, **words}) + "\n")
            self._process.stdin.flush()

    def receive(self, things: int = 1) -> dict[str, Any]:
        """The answer to the oldest request that has none yet, about so many things; errors are those of `ask`.

        A Blender that does not answer in a generous time is ended, and that is said.
        """
        if not self._ready:
            self._checked(self._next(ANSWER_SECONDS))
            self._ready = True
        return self._checked(self._next(ANSWER_SECONDS + MORE_SECONDS * (things - 1)))

    def is_answered(self, count: int = 1) -> bool:
        """Whether so many calls of `receive` would return at once, or the time for the answers is over."""
        is_late = time.monotonic() - self._asked_at > ANSWER_SECONDS
        return is_late or not self._reader.is_alive() or self._answers.qsize() >= count + (not self._ready)

    def close(self) -> None:
        """End the second Blender and remove its files."""
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        try:
            self._process.wait(END_SECONDS if self._ready else 0.0)
        except subprocess.TimeoutExpired:
            signal_group(self._process.pid, KILL)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(END_SECONDS)
        self._reader.join(END_SECONDS)
        if self._process.stdout is not None and not self._reader.is_alive():
            self._process.stdout.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> Probe:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        with contextlib.suppress(OSError, ValueError):
            for line in self._process.stdout:  # other lines are Blender's
                with contextlib.suppress(ValueError):
                    answer = json.loads(line)
                    if isinstance(answer, dict) and "status" in answer:
                        self._answers.put(answer)
        self._answers.put(None)

    @staticmethod
    def _checked(answer: dict[str, Any]) -> dict[str, Any]:
        if answer["status"] != "ok":
            raise ProbeError(answer["sentence"])
        return answer

    def _next(self, seconds: float) -> dict[str, Any]:
        """The next answer; the process is ended where none comes within so many seconds after it was asked."""
        try:
            answer = self._answers.get(timeout=max(self._asked_at + seconds - time.monotonic(), 0.0))
        except queue.Empty:
            signal_group(self._process.pid, KILL)
            raise ProbeError(
                f"The second Blender, which evaluates nodes, has not answered for {seconds / 60.0:.0f} minutes and was "
                "ended: try again, and if it stays so, give the material or the world fewer nodes or smaller images."
            ) from None
        if answer is not None:
            return answer
        self._answers.put(None)
        last = next((text for text in reversed(log_tail(self._log).splitlines()) if text.strip()), "its log is empty")
        raise ProbeError(f"The second Blender, which evaluates nodes, has ended: {last.strip()}")
