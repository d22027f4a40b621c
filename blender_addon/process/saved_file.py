# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender saves: whole, or an error. On a full disk it says that it has saved what is half of a file."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import bpy

# Blender's file format: the last block of a file, within its last bytes; a compressed one is zstd with a seek table
LAST_BLOCK, LAST_BYTES = b"ENDB", 64
ZSTD, SEEK_TABLE_END = b"\x28\xb5\x2f\xfd", b"\xb1\xea\x92\x8f"


def save_copy(path: Path) -> None:
    """Write the file as it is now to `path`; the session keeps its name and its unsaved changes.

    Raises
    ------
    OSError
        If it cannot be written as a whole; what was there before may be gone.
    """
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, check_existing=False)
    except RuntimeError as error:
        raise OSError(str(error).strip().removeprefix("Error: ")) from error
    if not path.is_file():
        raise OSError(f"{path} was not written")
    if not _is_whole(path):
        path.unlink()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def save_over(path: Path) -> None:
    """Write the file as it is now to `path`, where nothing is lost if that cannot be done.

    Raises
    ------
    OSError
        If it cannot be written; what was there before is as it was.
    """
    with tempfile.TemporaryDirectory(prefix="material_fit_", dir=path.parent) as folder:
        save_copy(Path(folder) / path.name)
    save_copy(path)  # there is room; moved from there, the file would leave no backup as Blender's own do


def _is_whole(path: Path) -> bool:
    with path.open("rb") as file:
        start = file.read(len(ZSTD))
        file.seek(max(path.stat().st_size - LAST_BYTES, 0))
        end = file.read()
    return end.endswith(SEEK_TABLE_END) if start == ZSTD else LAST_BLOCK in end
