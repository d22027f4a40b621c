# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary folders that carry the id of their process in their name: what a Blender that was killed leaves goes with
the next folder that is made."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Literal, get_args

from .process_group import process_lives

Kind = Literal["probe", "check", "view", "pixel"]  # what it is for
_NAME = re.compile(rf"material_fit_(?:{'|'.join(get_args(Kind))})_(\d{{1,9}})_\w{{8}}")  # process, mkdtemp's letters


def make_folder(kind: Kind) -> Path:
    """A new folder in the temporary folder, which its maker removes.

    Raises
    ------
    OSError
        If none can be made.
    """
    _remove_abandoned()
    return Path(tempfile.mkdtemp(prefix=f"material_fit_{kind}_{os.getpid()}_"))


@contextmanager
def temporary_folder(kind: Kind) -> Iterator[Path]:
    """A folder as of `make_folder` that is gone at the end of the block."""
    folder = make_folder(kind)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _remove_abandoned() -> None:
    """Remove the folders of processes that live no more."""
    with suppress(OSError):
        for path in Path(tempfile.gettempdir()).glob("material_fit_*"):
            found = _NAME.fullmatch(path.name)
            if found is not None and not process_lives(int(found[1])):
                shutil.rmtree(path, ignore_errors=True)
