# SPDX-License-Identifier: GPL-3.0-or-later
"""Ask a Python whether it runs the backend (`mfo doctor --json`), and keep what it said last time. No bpy here."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from ..process.backend_python import EXTENSION_ROOT, backend_environment
from ..process.process_group import KILL, own_group, signal_group

CHECK_SECONDS = 120.0  # seconds; the first start compiles a kernel with every LLVM it finds
_MEMORY = "tested.json"


@dataclass(frozen=True)
class Verdict:
    """Whether a backend works, one sentence, and a line for each problem with its cure."""

    works: bool
    sentence: str
    problems: list[str] = field(default_factory=list)


class BackendCheck:
    """A running test of the interpreter `python`; `poll` until `verdict` is set.

    Raises
    ------
    OSError
        If it cannot be started.
    """

    def __init__(self, python: Path, root: Path = EXTENSION_ROOT) -> None:
        self.python = python
        self.verdict: Verdict | None = None
        self._began = time.monotonic()
        # files, not pipes: nobody has to read them for the process to go on
        self._out, self._err = tempfile.TemporaryFile(), tempfile.TemporaryFile()  # noqa: SIM115  # `close` does
        self._process = subprocess.Popen(
            [str(python), "-m", "mfo_backend", "doctor", "--json"],
            stdin=subprocess.DEVNULL, stdout=self._out, stderr=self._err, cwd=root, env=backend_environment(root),
            **own_group(),
        )  # fmt: skip

    def poll(self) -> Verdict | None:
        """The verdict once there is one; never blocks."""
        if self.verdict is None and self._process.poll() is not None:
            self.verdict = _read(self._process.returncode, _content(self._out), _content(self._err), self.python)
        elif self.verdict is None and time.monotonic() - self._began > CHECK_SECONDS:
            self.close()
            self.verdict = Verdict(False, f"The backend did not answer within {CHECK_SECONDS:.0f} s.")
        return self.verdict

    def close(self) -> None:
        """End it."""
        if self._process.poll() is None:
            signal_group(self._process.pid, KILL)
            self._process.wait()
        self._out.close()
        self._err.close()


def remember(folder: Path, python: Path, verdict: Verdict) -> None:
    """Keep a good verdict, so that a later session need not ask; a bad one is asked for again."""
    with contextlib.suppress(OSError):
        if not verdict.works:
            (folder / _MEMORY).unlink(missing_ok=True)
            return
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _MEMORY).write_text(json.dumps({"key": _key(python), "verdict": asdict(verdict)}), "utf-8")


def remembered(folder: Path, python: Path) -> Verdict | None:
    """The good verdict about this interpreter, if it is still the program it was."""
    try:
        kept = json.loads((folder / _MEMORY).read_text("utf-8"))
        return Verdict(**kept["verdict"]) if kept["key"] == _key(python) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _key(python: Path) -> list[object]:
    """Changes with the interpreter, its packages and this extension."""
    packages = sorted(python.parent.parent.glob("lib*/python*/site-packages")) or [python.parent.parent / "Lib"]
    times = [p.stat().st_mtime for p in (python, *packages, EXTENSION_ROOT / "blender_manifest.toml") if p.exists()]
    return [str(python), *times]


def _content(file: object) -> str:
    file.seek(0)  # type: ignore[attr-defined]
    return file.read().decode("utf-8", "replace")  # type: ignore[attr-defined]


def _read(code: int, out: str, err: str, python: Path) -> Verdict:
    line = next((line for line in reversed(out.splitlines()) if line.startswith("{")), "")
    try:
        answer = json.loads(line)
        if "sentence" in answer and "checks" not in answer:  # it could not even begin
            # without the path and the command line that help in a terminal: here a button does it
            reason = str(answer["sentence"]).replace(f" in {python}", "").split(": run ")[0].rstrip(".")
            return Verdict(False, f"{reason}: install the backend, or choose another Python.")
        checks = {check["name"]: check for check in answer["checks"]}
        problems = _problems([check for check in checks.values() if check["state"] == "problem"])
    except (ValueError, KeyError, TypeError):
        last = next((text.strip() for text in reversed(err.splitlines()) if text.strip()), f"exit code {code}")
        return Verdict(False, f"{python} does not run the backend: {last}")
    if problems:
        return Verdict(False, "The backend is installed but cannot run.", problems)
    return Verdict(True, _summary({name: check["found"] for name, check in checks.items()}))


def _problems(checks: list[dict[str, str]]) -> list[str]:
    """A line for each problem with its cure; missing packages are one."""
    missing = [check["name"] for check in checks if check["found"] == "not installed"]
    others = [c for c in checks if c["name"] not in missing and not (missing and c["name"] == "Mitsuba variant")]
    lines = [f"{check['name']}: {check['found']}. {check['cure']}".strip() for check in others]
    if missing:
        lines.insert(0, f"Its Python lacks {', '.join(missing)}: install the backend, or choose another Python.")
    return lines


def _summary(found: dict[str, str]) -> str:
    """Versions and device in one line."""
    variant = found.get("Mitsuba variant", "")
    if variant.startswith("cuda"):
        device = found.get("GPU", "").split(",")[0] or "graphics card"
    else:
        device = f"processor, {found.get('threads', '?')} threads"
    python = re.match(r"[\d.]+", found.get("Python", ""))
    versions = (
        f"Mitsuba {found.get('mitsuba', '?')}, Dr.Jit {found.get('drjit', '?')}, Python {python[0] if python else '?'}"
    )
    return f"{versions}; {device}"
