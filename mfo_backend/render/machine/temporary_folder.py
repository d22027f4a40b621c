# SPDX-License-Identifier: Apache-2.0
"""Temporary folders that carry the id of their process in their name: what one that was killed leaves goes at the next
start of a command."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal, get_args

from .other_process import liveness_of

Kind = Literal["llvm", "nodes", "hdrvdp"]  # what it is for
_NAME = re.compile(rf"mfo_(?:{'|'.join(get_args(Kind))})_(\d{{1,9}})_\w{{8}}")  # the process, mkdtemp's letters


def make_folder(kind: Kind) -> Path:
    """A new folder in the system's temporary folder, which its maker removes."""
    return Path(tempfile.mkdtemp(prefix=f"mfo_{kind}_{os.getpid()}_"))


@contextmanager
def temporary_folder(kind: Kind) -> Iterator[Path]:
    """A folder as of `make_folder` that is gone at the end of the block."""
    folder = make_folder(kind)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def remove_abandoned() -> None:
    """Remove the folders of processes that live no more."""
    for path in Path(tempfile.gettempdir()).glob("mfo_*"):
        found = _NAME.fullmatch(path.name)
        if found is not None and not liveness_of(int(found[1]))():
            shutil.rmtree(path, ignore_errors=True)
