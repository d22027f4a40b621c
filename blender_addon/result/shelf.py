# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs whose results are not saved in their .blend yet: one small file each, kept until they are. No bpy here."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ..process.process_group import process_lives


@dataclass(frozen=True)
class Shelved:
    """A job of a .blend file and the process id of the Blender that started it."""

    blend: str
    job: Path
    pid: int

    @property
    def may_run(self) -> bool:
        """Whether another Blender may be at work on it."""
        return not (self.job / "result.json").is_file() and self.pid != os.getpid() and process_lives(self.pid)


def put(shelf: Path, blend: str, job: Path) -> None:
    """Note that a job belongs to a .blend file that does not hold its result.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    shelf.mkdir(parents=True, exist_ok=True)
    entry = {"blend": blend, "job": str(job), "pid": os.getpid()}
    path = _entry(shelf, job)
    unfinished = path.with_suffix(f".{os.getpid()}.tmp")
    unfinished.write_text(json.dumps(entry), encoding="utf-8")
    os.replace(unfinished, path)


def of(shelf: Path, blend: str) -> list[Shelved]:
    """The jobs that wait for this .blend file, the oldest first; those whose folder is gone are forgotten."""
    found = []
    for path in shelf.glob("*.json"):
        with suppress(OSError, ValueError, KeyError, TypeError):
            entry = json.loads(path.read_text("utf-8"))
            shelved = Shelved(str(entry["blend"]), Path(entry["job"]), int(entry["pid"]))
            if not shelved.job.is_dir():
                path.unlink()
            elif shelved.blend == blend:
                found.append((path.stat().st_mtime_ns, shelved))
    return [shelved for _, shelved in sorted(found, key=lambda one: one[0])]


def take_off(shelf: Path, job: Path) -> None:
    """Forget a job; nothing happens where it is not there."""
    with suppress(OSError):
        _entry(shelf, job).unlink()


def _entry(shelf: Path, job: Path) -> Path:
    return shelf / f"{hashlib.sha256(str(job).encode()).hexdigest()[:24]}.json"
