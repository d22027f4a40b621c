# SPDX-License-Identifier: GPL-3.0-or-later
"""The second Blender: opens a copy of a file and answers requests about it until nobody asks any more.

A request is one JSON object on a line of stdin, `{"command": NAME, ...}`; the answer is one on a line of stdout with
`status` ("ok", "bad_input", "failed") and, unless it is ok, a `sentence`. What Blender itself prints goes to stderr.
The first line, without a request, says that the file is open. The folder of the copy is removed at the end, also when
the process that asks was killed.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

Command = Callable[[Mapping[str, Any]], Mapping[str, Any]]

# a command is a function of a request in a module beside this folder; it leaves the open file as it found it
COMMANDS = {
    "sockets": ("probe.socket_pictures", "answer"),
    "values": ("probe.value_pictures", "answer"),
    "world": ("bake.requests", "world"),
    "displaced": ("bake.requests", "displaced"),
    "lamp": ("bake.requests", "lamp"),
    "surfaces": ("bake.requests", "surfaces"),
    "paint": ("bake.requests", "paint"),
}
LOOK_SECONDS = 1.0  # between two looks whether the parent is still there


class ProbeRequestError(Exception):
    """The request cannot be answered; the message is one sentence for the user."""


def main(arguments: Sequence[str]) -> int:
    """Open the file and answer until stdin ends; returns the exit code."""
    parser = argparse.ArgumentParser(prog="probe")
    parser.add_argument("file", type=Path, help="the copy; its folder belongs to this process")
    parser.add_argument("--folder", type=Path, help="belongs to this process instead, and the copy does not")
    parser.add_argument("--parent", type=int, default=0, help="end when this process is not the parent any more")
    chosen = parser.parse_args(arguments)
    stream = _take_stdout()
    folder = chosen.folder or chosen.file.parent
    _watch_parent(chosen.parent, folder)
    try:
        _say(stream, _open(chosen.file))
        for line in sys.stdin:
            if line.strip():
                _say(stream, _answer(line))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


def _open(file: Path) -> Mapping[str, Any]:
    import bpy

    try:
        bpy.ops.wm.open_mainfile(filepath=str(file), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        return {"status": "failed", "sentence": f"The copy of the file cannot be opened ({str(error).strip()})."}
    from .graph_copy import unlink_unknown

    unlink_unknown()
    return {"status": "ok", "blender": list(bpy.app.version)}


def _answer(line: str) -> Mapping[str, Any]:
    try:
        request = json.loads(line)
        name = request["command"]
        if name not in COMMANDS:
            return {"status": "failed", "sentence": f"There is no command {name!r}."}
        module, function = COMMANDS[name]
        command: Command = getattr(importlib.import_module(f"blender_addon.{module}"), function)
        return {"status": "ok", **command(request)}
    except ProbeRequestError as error:
        return {"status": "bad_input", "sentence": str(error)}
    except Exception as error:  # the caller reads one line, never a traceback
        words = " ".join(str(error).split())
        return {"status": "failed", "sentence": f"Blender failed with {type(error).__name__}: {words}"}


def _say(stream: TextIO, answer: Mapping[str, Any]) -> None:
    stream.write(json.dumps(answer) + "\n")
    stream.flush()


def _take_stdout() -> TextIO:
    """The stdout of this process, for answers alone: what Blender's own code prints goes to stderr from now on."""
    sys.stdout.flush()
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return stream


def _watch_parent(pid: int, folder: Path) -> None:
    """End this process when the one that started it is gone, also in the middle of a render."""

    def watch() -> None:
        while os.getppid() == pid:
            time.sleep(LOOK_SECONDS)
        end = time.monotonic() + LOOK_SECONDS
        while folder.exists() and time.monotonic() < end:  # a render may write meanwhile
            shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    if pid and os.name != "nt":  # Windows keeps the id of a parent that is gone
        threading.Thread(target=watch, daemon=True).start()


def _run() -> None:
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    if not __package__:  # run by a Blender program as a script
        sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    # as a module of the package: errors of this script's own copy of it are others than those that commands raise
    from blender_addon.probe import server

    code = server.main(words)
    import bpy

    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)  # what Blender's own end would remove
    sys.stderr.flush()
    os._exit(code)  # the destructors of the bpy module may wait for ever after a render


if __name__ == "__main__":
    _run()
