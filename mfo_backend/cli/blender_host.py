# SPDX-License-Identifier: Apache-2.0
"""A Blender to work with from outside: a Blender program, or the bpy module in a process of its own."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..types.errors import BadInputError, MfoError, SetupError
from ..types.status import Status

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "blender_addon" / "headless.py"
NODE_SERVER = ROOT / "blender_addon" / "probe" / "server.py"
MODULE = "blender_addon.headless"
SHELL_SIGNALS = 128  # a shell gives this and the signal's number for a program that a signal ended
ERRORS = {Status.BAD_INPUT: BadInputError, Status.SETUP: SetupError}


@dataclass(frozen=True)
class BlenderHost:
    """How to run the add-on's `headless.py`; `command` is everything before its own arguments."""

    name: str
    command: tuple[str, ...]

    @property
    def node_server(self) -> tuple[str, ...]:
        """The command line of the add-on's `probe/server.py`, before its own arguments."""
        return tuple(
            str(NODE_SERVER) if word == str(SCRIPT) else "blender_addon.probe.server" if word == MODULE else word
            for word in self.command
        )

    def call(self, *arguments: str | Path) -> Mapping[str, Any]:
        """Run one command of `headless.py` and return the JSON object it answers.

        Raises
        ------
        BadInputError, SetupError, MfoError
            With the sentence the add-on gave, or the last lines of Blender's output if it ended without one.
        """
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONSTARTUP")}
        environment["PYTHONPATH"] = str(ROOT)
        words = [*self.command, *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, env=environment, errors="replace")
        answer = _last_json_object(done.stdout)
        if answer is None:
            raise MfoError(self._without_answer(done, arguments))
        if answer["status"] != "ok":
            raise ERRORS.get(Status(answer["status"]), MfoError)(answer["sentence"])
        return answer

    def _without_answer(self, done: subprocess.CompletedProcess[str], arguments: tuple[str | Path, ...]) -> str:
        """The sentence for a Blender that ended without a word of its own; a crash is Blender's, not the user's."""
        tail = " | ".join((done.stderr + done.stdout).strip().splitlines()[-4:])
        code = done.returncode
        if 0 <= code <= SHELL_SIGNALS:
            return f"{self.name} ended with code {code} and no answer: {tail}"
        try:
            name = signal.Signals(-code if code < 0 else code - SHELL_SIGNALS).name
        except ValueError:  # Windows has codes of its own
            name = f"code {code}"
        what = " of ".join(str(word) for word in arguments[:2])
        return (
            f"{self.name} crashed ({name}) in the {what}. Open the file in Blender and render it once: if that crashes "
            f"as well, remove what crashes it (a simulation's cache, an add-on's data). It said last: {tail}"
        )


def find_blender_host(program: str | None = None) -> BlenderHost:
    """The Blender to use: `program`, else MFO_BLENDER, else the bpy module of this Python, else `blender` on the PATH.

    Raises
    ------
    SetupError
        If there is none, or the named program does not exist, or the add-on is not beside the backend.
    """
    if not SCRIPT.is_file():
        raise SetupError(f"The add-on is missing: {SCRIPT} does not exist; use a checkout or the unpacked extension.")
    program = program or os.environ.get("MFO_BLENDER", "").split(os.pathsep)[0]
    if not program and importlib.util.find_spec("bpy"):
        return BlenderHost("The bpy module", (sys.executable, "-m", MODULE))
    path = shutil.which(program or "blender")
    if path is None:
        raise SetupError(
            f"Blender program {program!r} does not exist; set MFO_BLENDER or --blender to one."
            if program
            else "No Blender found: install the bpy module (Python 3.11), or set MFO_BLENDER to a Blender program."
        )
    options = ("--background", "--factory-startup", "--python-exit-code", "1", "--python", str(SCRIPT), "--")
    return BlenderHost(path, (path, *options))


def _last_json_object(text: str) -> dict[str, Any] | None:
    """The last line of `text` that is a JSON object; Blender prints lines of its own around it."""
    for line in reversed(text.splitlines()):
        if line.startswith("{"):
            try:
                return json.loads(line)
            except ValueError:
                continue
    return None
