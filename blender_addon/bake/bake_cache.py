# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes of earlier exports, kept by what they hang on in a folder of the user's, at most so many bytes.

An entry is a folder that appears whole or not at all, with a digest of each of its files: what a disk or a crash of the
machine has damaged is removed and made anew. Several processes may read, add and remove at the same time.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy

from ..process.process_group import process_lives

MOST_BYTES = 2**30  # in all; a surface of 1024 texels with three colours has 38 MB
_ANSWER = "answer.json"
_ENTRY = re.compile(r"[0-9a-f]{64}")
_UNFINISHED = re.compile(r"\.(\d+)\..+")  # of the process that writes or removes it


def cache_folder() -> str:
    """Where bakes are kept: MFO_BAKES (none if that is empty), `bakes` in MFO_CACHE_DIR, or a folder of the user's.

    That is beside the extension's jobs, or among Blender's data files where this is not installed as an extension.
    """
    if "MFO_BAKES" in os.environ:
        return os.environ["MFO_BAKES"]
    return str(_default_folder())


def _default_folder() -> Path:
    if os.environ.get("MFO_CACHE_DIR"):
        return Path(os.environ["MFO_CACHE_DIR"]) / "bakes"
    try:
        return Path(bpy.utils.extension_path_user((__package__ or "").rpartition(".blender_addon.")[0], path="bakes"))
    except ValueError:  # not installed as an extension
        return Path(bpy.utils.user_resource("DATAFILES", path="material_fit")) / "bakes"


def cached(
    cache: Path | None, key: str | None, place: Path, bake: Callable[[], dict[str, Any]], most_bytes: int = MOST_BYTES
) -> dict[str, Any]:
    """The answer of an earlier bake of this key, its files copied into the empty folder `place`, or that of `bake`.

    Without a key or a folder nothing is kept. A cache that cannot be read or written only costs time.
    """
    if cache is None or key is None:
        return bake()
    found = _found(cache / key, place)
    if found is not None:
        return found
    answer = bake()
    with suppress(OSError):
        _remove(cache / key)  # what is there is damaged, or of another process that was quicker
        _keep(cache, key, place, answer, most_bytes)
    return answer


def _found(entry: Path, place: Path) -> dict[str, Any] | None:
    try:
        kept = json.loads((entry / _ANSWER).read_text("utf-8"))
        for name in kept["files"]:
            shutil.copyfile(entry / Path(name).name, place / name)
        if kept["digest"] != _digest(kept["answer"], {name: place / name for name in kept["files"]}):
            raise ValueError(entry)
        os.utime(entry)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        for path in place.iterdir():
            path.unlink()
        return None
    return kept["answer"]


def _digest(answer: dict[str, Any], files: dict[str, Path]) -> str:
    """Of an answer and the files that it is about."""
    found = hashlib.blake2b(json.dumps(answer, sort_keys=True).encode())
    for name in sorted(files):
        with files[name].open("rb") as file:
            found.update(f"{name} {hashlib.file_digest(file, hashlib.blake2b).hexdigest()}".encode())
    return found.hexdigest()


def _keep(cache: Path, key: str, place: Path, answer: dict[str, Any], most_bytes: int) -> None:
    cache.mkdir(parents=True, exist_ok=True)
    files = list(place.iterdir())
    size = sum(path.stat().st_size for path in files)
    _make_room(cache, most_bytes - size)
    if size > most_bytes:
        return
    partial = Path(tempfile.mkdtemp(prefix=f".{os.getpid()}.", dir=cache))
    try:
        for path in files:
            shutil.copyfile(path, partial / path.name)
        kept = {path.name: path for path in files}
        entry = {"answer": answer, "files": list(kept), "digest": _digest(answer, kept)}
        (partial / _ANSWER).write_text(json.dumps(entry), "utf-8")
        partial.rename(cache / key)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _make_room(cache: Path, most_bytes: int) -> None:
    """Remove what was not used for longest, and what processes that were killed have left."""
    entries = []
    for path in cache.iterdir():
        left = _UNFINISHED.fullmatch(path.name)
        if left is not None and not process_lives(int(left[1])):
            shutil.rmtree(path, ignore_errors=True)
        elif _ENTRY.fullmatch(path.name):
            with suppress(OSError):
                entries.append((path.stat().st_mtime, path, sum(file.stat().st_size for file in path.iterdir())))
    total = sum(size for _, _, size in entries)
    for _, path, size in sorted(entries):
        if total <= most_bytes:
            return
        with suppress(OSError):
            _remove(path)
            total -= size


def _remove(entry: Path) -> None:
    """Remove an entry, if it is there."""
    gone = entry.with_name(f".{os.getpid()}.{entry.name}")
    with suppress(FileNotFoundError):
        entry.rename(gone)  # first: no reader sees half of it
        shutil.rmtree(gone, ignore_errors=True)
