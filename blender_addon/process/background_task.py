# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs run one after the other beside Blender, watched without waiting for them. No bpy here."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .job_process import log_tail
from .process_group import KILL, own_group, signal_group

TASK_TICK = 0.2  # seconds between two looks at a program that runs
_SAMPLE = re.compile(r"Sample (\d+)/(\d+)")  # as Cycles prints it


@dataclass(frozen=True)
class Step:
    """A program that prints one JSON object, perhaps among other lines, on its stdout."""

    words: Sequence[str]
    environment: Mapping[str, str]
    label: str


class BackgroundTask:
    """Runs the steps in order and stops at the first that fails.

    Parameters
    ----------
    steps
        What to run; the task starts at once.
    folder
        Where the logs go.

    Raises
    ------
    OSError
        If the first program cannot be started.
    """

    def __init__(self, steps: Sequence[Step], folder: Path) -> None:
        self.answers: list[dict[str, Any]] = []
        self.sentence = ""  # why it failed
        self._steps, self._folder = list(steps), folder
        self._process: subprocess.Popen[bytes] | None = None
        self._start()

    @property
    def is_running(self) -> bool:
        """Whether something is still to be done."""
        return self._process is not None

    def poll(self) -> None:
        """See whether the program has ended, and start the next; never blocks."""
        if self._process is None or self._process.poll() is None:
            return
        answer, code = _last_object(self._log()), self._process.returncode
        self._process = None
        if code or answer is None or answer.get("status", "ok") != "ok":
            said = (answer or {}).get("sentence")
            self.sentence = said or f"{self._label()} failed (exit code {code}): {self._last_line()}"
            return
        self.answers.append(answer)
        if len(self.answers) < len(self._steps):
            try:
                self._start()
            except OSError as error:
                self.sentence = f"{self._label()} failed: {error.strerror or error}."

    def progress(self) -> str:
        """What it does, with the samples a render has done so far."""
        found = _SAMPLE.findall(log_tail(self._log(), lines=4))
        return f"{self._label()}, sample {found[-1][0]} of {found[-1][1]}" if found else self._label()

    def close(self) -> None:
        """Kill the program that runs, with all it started."""
        if self._process is not None:
            signal_group(self._process.pid, KILL)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(2.0)
            self._process = None

    def _start(self) -> None:
        step = self._steps[len(self.answers)]
        with open(self._log(), "wb") as log:
            self._process = subprocess.Popen(
                list(step.words), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
                env=dict(step.environment), cwd=self._folder, **own_group(),
            )  # fmt: skip

    def _label(self) -> str:
        return self._steps[min(len(self.answers), len(self._steps) - 1)].label

    def _log(self) -> Path:
        return self._folder / f"step_{len(self.answers)}.log"

    def _last_line(self) -> str:
        return next((line for line in reversed(log_tail(self._log()).splitlines()) if line.strip()), "its log is empty")


def environment_for(root: Path) -> dict[str, str]:
    """This process' environment with `root` on PYTHONPATH and nothing that bends another Python."""
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONSTARTUP", "PYTHONPATH")}
    return kept | {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}


def _last_object(log: Path) -> dict[str, Any] | None:
    for line in reversed(log_tail(log).splitlines()):
        if line.startswith("{"):
            with contextlib.suppress(ValueError):
                return json.loads(line)
    return None
