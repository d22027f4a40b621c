# SPDX-License-Identifier: GPL-3.0-or-later
"""The installation of the backend as something to look at from a timer: start, poll, cancel. No bpy here.

A thread finds the Python and starts `backend_install_script.py` with it; its output is the log file, which `poll` reads
on. Blender's own Python is at most the program that `venv` links to; nothing is ever installed into it.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from ..process.backend_python import backend_environment
from ..process.process_group import KILL, own_group, signal_group
from .backend_folder import LOCK, LOG, complete, new_environment
from .interpreters import InterpreterError, find_interpreter

SCRIPT = Path(__file__).resolve().with_name("backend_install_script.py")
CLEAN_UP_SECONDS = 5.0  # seconds the script has to clean up after itself
SIZE = "about 130 MB to download, 450 MB on the disk"  # measured with the lock file of July 2026, Linux
_LOG_LINES = 2000
_CANCELLED = 4


@dataclass(frozen=True)
class InstallOutcome:
    """How it ended: `installed`, `cancelled` or `failed`, and one sentence."""

    status: str
    sentence: str


class BackendInstall:
    """A running installation into a new environment below `root`.

    Parameters
    ----------
    root
        Folder of the environments; made if it is missing.
    chosen
        Interpreter to build on; empty: one is looked for.
    wheels
        Folder of wheels to install from without network; empty: from where pip is configured to.
    """

    def __init__(self, root: Path, chosen: str = "", wheels: str = "", lock: Path = LOCK) -> None:
        self.root, self.log = root, root / LOG
        self.lines: list[str] = []
        self.outcome: InstallOutcome | None = None
        self._chosen, self._wheels, self._lock = chosen, wheels, lock
        self._packages = max(1, len(re.findall(r"^[\w.-]+==", lock.read_text("utf-8"), re.MULTILINE)))
        self._read, self._log_is_new = 0, False
        self._stop = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        self._ended: InstallOutcome | None = None
        self._thread = threading.Thread(target=self._work, name="mfo-install", daemon=True)
        self._thread.start()

    @property
    def cancelling(self) -> bool:
        """Whether `cancel` was called and it still runs."""
        return self._stop.is_set() and self.outcome is None

    @property
    def pid(self) -> int | None:
        """Process id of the script once it runs, which is also its group's."""
        return self._process.pid if self._process else None

    @property
    def step(self) -> str:
        """What it is doing, in two or three words."""
        if self.cancelling:
            return "Cancelling"
        for line in reversed(self.lines):
            if line.startswith("Installing collected"):
                return "Unpacking"
            if found := re.match(r"(?:Collecting|Downloading|Processing) (?:\S*/)?([A-Za-z]+)", line.strip()):
                return f"Fetching {found[1]}"
            if line.startswith("$"):
                return "Making the environment" if " venv " in line else "Fetching packages"
        return "Looking for a Python"

    @property
    def fraction(self) -> float:
        """A rough share of the work done, by the packages named in the log; markers leave some of the lock out."""
        named = sum(line.startswith(("Collecting ", "Processing ")) for line in self.lines)
        unpacking = any(line.startswith("Installing collected") for line in self.lines)
        return 0.8 if unpacking else min(0.75, 0.05 + 0.7 * named / self._packages)

    def poll(self) -> bool:
        """Read on in the log and set `outcome` at the end; True if anything changed. Never blocks."""
        changed = self._read_log()
        if self.outcome is None and self._ended is not None and not self._thread.is_alive():
            self._read_log()
            self.outcome, changed = self._ended, True
        return changed

    def cancel(self) -> None:
        """Ask it to stop; what it has made is removed."""
        self._stop.set()
        self._close_stdin()

    def close(self) -> None:
        """Stop within some seconds and wait for it."""
        self.cancel()
        self._thread.join()
        self.poll()

    def _work(self) -> None:
        try:
            self._ended = self._install()
        except InterpreterError as error:
            self._ended = InstallOutcome("failed", str(error))
        except OSError as error:
            self._ended = InstallOutcome(
                "failed", f"The backend cannot be installed in {self.root} ({error.strerror or error})."
            )
        finally:
            self._close_stdin()

    def _install(self) -> InstallOutcome:
        self.root.mkdir(parents=True, exist_ok=True)
        with open(self.log, "wb") as log:
            self._log_is_new = True
            python = find_interpreter(self._chosen)
            log.write(f"Python {python.version}, {python.path}\n".encode())
            log.flush()
            environment = new_environment(self.root, self._lock)
            words = [str(python.path), "-I", str(SCRIPT), str(environment), str(self._lock), self._wheels]
            try:
                if not self._stop.is_set():
                    self._process = subprocess.Popen(
                        words, stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT, cwd=self.root,
                        env=backend_environment(self.root), **own_group(),
                    )  # fmt: skip
                code = self._wait()
                if code == 0:
                    complete(environment, {"python": python.version, "base": str(python.path)})
                    return InstallOutcome("installed", f"Installed with Python {python.version}.")
            except OSError:
                shutil.rmtree(environment, ignore_errors=True)
                raise
        shutil.rmtree(environment, ignore_errors=True)  # the script did it, unless it was killed
        if self._stop.is_set() or code == _CANCELLED:
            return InstallOutcome("cancelled", "Cancelled; nothing was installed.")
        return InstallOutcome("failed", _why(self.log, self._wheels, python.version))

    def _wait(self) -> int:
        process, deadline = self._process, None
        while process is not None and process.poll() is None:
            if self._stop.is_set():
                self._close_stdin()
                deadline = deadline or time.monotonic() + CLEAN_UP_SECONDS
                if time.monotonic() > deadline:
                    signal_group(process.pid, KILL)
            time.sleep(0.05)
        return _CANCELLED if process is None else process.returncode

    def _close_stdin(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()

    def _read_log(self) -> bool:
        if not self._log_is_new:
            return False
        try:
            with open(self.log, "rb") as file:
                file.seek(self._read)
                new = file.read(1 << 16)
        except OSError:
            return False
        new = new[: new.rfind(b"\n") + 1]
        self._read += len(new)
        self.lines = [*self.lines, *new.decode("utf-8", "replace").splitlines()][-_LOG_LINES:]
        return bool(new)


def _why(log: Path, wheels: str, version: str) -> str:
    """One sentence from the end of pip's output."""
    lines = [line.strip() for line in log.read_text("utf-8", "replace").splitlines() if line.strip()]
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR:")]
    reason = (errors or lines or ["it is empty"])[-1].rstrip(".")
    text = "\n".join(lines)
    if "No space left" in text:
        return f"The disk is full: free some space ({SIZE}) and install again."
    missing = re.search(r"No matching distribution found for (\S+)", text)
    if missing and wheels:
        return f"The folder {wheels} has no wheel of {missing[1]} for Python {version} on this system."
    if missing and re.search(r"connection|resolve|SSL|proxy|timed out|Network is unreachable", text, re.IGNORECASE):
        return f"The packages could not be downloaded ({_network_reason(lines)}): check the connection."
    if missing:
        return f"{missing[1]} is not to be had for Python {version} on this system: choose another Python."
    if "HASH" in reason or "DO NOT MATCH THE HASHES" in text:
        return "A package is not the one this version was made with (its hash differs): try another source."
    return f"The installation failed: {reason}. The log is {log}."


def _network_reason(lines: list[str]) -> str:
    fetch = next((line for line in lines if line.startswith("Could not fetch URL")), "")
    broken = next((line for line in lines if "connection broken by" in line), "")
    found = re.search(r"connection broken by '(\w+)", broken)
    return fetch.split(": ", 1)[-1].removesuffix(" - skipping")[:160] or (found[1] if found else "no connection")
