# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the backend's virtual environment; run as a script by the Python that is to carry it, beside Blender.

    python backend_install_script.py ENVIRONMENT LOCK [WHEELS]

Output of venv and pip goes to stdout line by line. It ends, and removes what it has made, when its stdin reaches the
end: Blender closed it to cancel, or Blender is gone. Exit codes: 0 done, 1 failed, 4 cancelled. Only the standard
library, and nothing of ours: the interpreter may be any from 3.10 on.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

_running: subprocess.Popen[bytes] | None = None
_cancelled = threading.Event()


def main(environment: Path, lock: Path, wheels: str) -> int:
    """Make the environment and fill it; on any failure it is removed."""
    signal.signal(signal.SIGTERM, lambda *_: _cancelled.set())  # a handler, not SIG_IGN: that one children inherit
    threading.Thread(target=_watch, daemon=True).start()
    python = environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    source = ["--no-index", "--find-links", wheels] if wheels else []
    pip = ["-I", "-u", "-X", "utf8", "-m", "pip", "--disable-pip-version-check", "--no-input", "install"]
    options = ["--progress-bar", "off", "--only-binary", ":all:", "--require-hashes", "--no-deps", *source]
    steps = (
        [sys.executable, "-I", "-u", "-m", "venv", str(environment)],
        [str(python), *pip, *options, "--no-warn-script-location", "-r", str(lock)],
    )
    code = 1
    try:
        for step in steps:
            print(f"$ {' '.join(step)}", flush=True)
            code = _run(step)
            if code or _cancelled.is_set():
                break
    finally:
        if code or _cancelled.is_set():
            shutil.rmtree(environment, ignore_errors=True)
    return 4 if _cancelled.is_set() else 1 if code else 0


def _run(command: list[str]) -> int:
    global _running
    _running = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT)
    if _cancelled.is_set():
        _end_children()
    return _running.wait()


def _watch() -> None:
    """Wait for the end of stdin; then what runs is killed and `main` cleans up."""
    while os.read(0, 64):
        pass
    _cancelled.set()
    _end_children()


def _end_children() -> None:
    """End what runs and what that has started: venv runs pip in a process of its own."""
    if _running is None:
        return
    if os.name == "nt":
        subprocess.run(["taskkill", "/T", "/F", "/PID", str(_running.pid)], capture_output=True, check=False)
    elif os.getpgrp() == os.getpid():
        os.killpg(os.getpgrp(), signal.SIGTERM)  # this process has a handler for it
    else:
        _running.kill()


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else ""))
