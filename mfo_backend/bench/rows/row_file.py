# SPDX-License-Identifier: Apache-2.0
"""rows.jsonl: rows appended as they come, each on the disk before the next begins."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from ...job.folder.atomic_file import write_atomically
from ...job.output.progress import finite
from ...types.errors import BadInputError
from .row import Key, Row

_FIELDS = {f.name for f in fields(Row)}


class RowFile:
    """The rows of a bench folder. A process that was killed in the middle of a line leaves no half row behind."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "rows.jsonl"

    def read(self) -> list[Row]:
        """All complete rows in the order of their arrival; the first of equal keys counts.

        Raises
        ------
        BadInputError
            If the file cannot be read or a line other than an unfinished last one is no row.
        """
        try:
            data = self.path.read_bytes()
        except FileNotFoundError:
            return []
        except OSError as error:
            raise BadInputError(f"Cannot read {self.path}: {error.strerror}.") from error
        rows: dict[Key, Row] = {}
        for number, line in enumerate(data[: data.rfind(b"\n") + 1].splitlines(), start=1):
            row = self._row(line, number)
            rows.setdefault(row.key, row)
        return list(rows.values())

    @contextmanager
    def only_writer(self) -> Iterator[None]:
        """Keep other benches out of the folder while the block runs; a process that is killed keeps nobody out.

        Raises
        ------
        BadInputError
            If another bench is writing there.
        """
        try:
            import fcntl
        except ImportError:  # Windows: two benches in one folder are the user's to avoid
            yield
            return
        with open(self.path.with_name("rows.lock"), "ab") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise BadInputError(
                    f"Another bench is writing into {self.path.parent}: wait for it, or give another folder with --out."
                ) from None
            yield

    def append(self, row: Row) -> None:
        """Add a row and wait until the disk has it; an unfinished line of a killed process is cut off first."""
        line = _line(row)
        with open(self.path, "a+b") as file:
            self._cut_unfinished(file)
            file.write(line)
            file.flush()
            os.fsync(file.fileno())

    def replace(self, rows: Iterable[Row]) -> None:
        """Put rows in the place of those with their keys, all at once; the others and the order stay."""
        new = {row.key: row for row in rows}
        kept = [new.get(row.key, row) for row in self.read()]
        write_atomically(self.path, b"".join(_line(row) for row in kept))

    def _cut_unfinished(self, file: Any) -> None:
        end = file.seek(0, os.SEEK_END)
        file.seek(max(0, end - 1))
        if end and file.read(1) != b"\n":
            file.seek(0)
            file.truncate(file.read().rfind(b"\n") + 1)

    def _row(self, line: bytes, number: int) -> Row:
        try:
            values = json.loads(line)
            return Row(**{name: value for name, value in values.items() if name in _FIELDS})
        except (ValueError, TypeError, AttributeError) as error:
            raise BadInputError(
                f"Line {number} of {self.path} is no row of a bench: remove the line or give another folder."
            ) from error


def _line(row: Row) -> bytes:
    return json.dumps(finite(asdict(row)), ensure_ascii=False, allow_nan=False).encode("utf-8") + b"\n"


def keep_setup(folder: Path, setup: Mapping[str, Any]) -> None:
    """Note in `folder` what all its rows share, or check that it is the same as before.

    Raises
    ------
    BadInputError
        If the folder holds rows of another setup, or cannot be written.
    """
    path = folder / "setup.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            if (folder / "rows.jsonl").exists():
                raise BadInputError(f"{folder} holds rows of an unknown setup: give another folder with --out.")
            write_atomically(path, json.dumps(setup, indent=1).encode("utf-8"))
            return
        before = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise BadInputError(f"Cannot use the folder {folder}: {error.strerror}.") from error
    except ValueError as error:
        raise BadInputError(f"{path} is damaged: give another folder with --out.") from error
    differing = [name for name in setup if before.get(name) != setup[name]]
    if differing:
        raise BadInputError(
            f"The rows in {folder} were made with another {' and '.join(differing)}: give another folder with --out."
        )
