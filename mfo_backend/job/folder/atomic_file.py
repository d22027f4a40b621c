# SPDX-License-Identifier: Apache-2.0
"""Files that are complete as soon as they exist."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_atomically(path: Path, content: bytes) -> None:
    """Write `content` beside `path`, then move it there; on an error nothing is left behind.

    Raises
    ------
    OSError
        If the folder cannot be written or the disk is full.
    """
    # a leading dot and a suffix of our own: a folder watcher does not take it for the file
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o666 & ~_umask())  # mkstemp makes it private to the user
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
