# SPDX-License-Identifier: GPL-3.0-or-later
"""A job folder that appears whole or not at all."""

from __future__ import annotations

import errno
import filecmp
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ...process.process_group import process_lives
from ..findings import ExportError

GENERATOR = "material_fit_mfo"
_ABANDONED = re.compile(r"\..+\.(\d+)\.[a-z0-9_]+\.(partial|old)")  # hidden, process id, mkdtemp's letters
MORE_PICTURES = "more_pictures"  # folder of the further pictures of a job, each a job folder of its own
TARGETS = "targets"  # the same of materials that are fitted together
# what a job folder may hold; a folder with anything else is somebody's own
OWN_NAMES = {
    "request.json", "scene.xml", "meshes", "textures", "graph", MORE_PICTURES, TARGETS, "view_lut.exr",
    "progress.jsonl", "cancel", "result.json", "partial.json", "pictures", "index.html", "backend.log",
}  # fmt: skip


def share_files(job: Path, inner: Path) -> None:
    """Let the meshes and textures of a further picture, and of materials in it, be the first's where they are the same.

    Where a file system has no hard links they stay copies.
    """
    for path in [*inner.rglob("meshes/*"), *inner.rglob("textures/*")]:
        twin = job / path.parent.name / path.name
        if twin.is_file() and filecmp.cmp(twin, path, shallow=False):
            spare = path.with_suffix(".link")
            with suppress(OSError):
                os.link(twin, spare)
                os.replace(spare, path)


def link_files(job: Path, inner: Path) -> None:
    """Let a folder inside of a job have its scene and its pictures, too; without hard links they are copies."""
    inner.mkdir(parents=True, exist_ok=True)
    shared = [job / "scene.xml", *job.glob("meshes/*"), *job.glob("textures/*")]
    for path in [*shared, *job.glob("reference.*"), *job.glob("mask.*"), *job.glob("view_lut.exr")]:
        twin = inner / path.relative_to(job)
        twin.parent.mkdir(exist_ok=True)
        try:
            os.link(path, twin)
        except OSError:
            shutil.copyfile(path, twin)


@contextmanager
def new_job_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty folder beside `folder`; when the block ends well it becomes `folder`, else nothing is left.

    Raises
    ------
    ExportError
        If `folder` holds something else than an earlier job, cannot be written, or the disk is full.
    """
    _refuse_foreign(folder)
    partial: Path | None = None
    missing = [parent for parent in folder.parents if not parent.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(folder.parent)
        partial = Path(tempfile.mkdtemp(prefix=f".{folder.name}.{os.getpid()}.", suffix=".partial", dir=folder.parent))
        partial.chmod(0o755)
        yield partial
        _replace(partial, folder)
    except OSError as problem:
        raise ExportError(_sentence(problem, folder)) from problem
    finally:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)
        if not folder.exists():
            for parent in missing:
                with suppress(OSError):
                    parent.rmdir()


def _refuse_foreign(folder: Path) -> None:
    try:
        if not folder.exists():
            return
        if not folder.is_dir():
            raise ExportError(f"{folder} is a file; choose a folder for the job.")
        names = {entry.name for entry in folder.iterdir() if not entry.name.startswith("reference.")}
    except OSError as problem:
        raise ExportError(_sentence(problem, folder)) from problem
    if names and not (names <= OWN_NAMES and _is_job(folder)):
        raise ExportError(f"{folder} holds other files than a job; choose an empty or a new folder.")


def _is_job(folder: Path) -> bool:
    try:
        request = json.loads((folder / "request.json").read_text("utf-8"))
        return request["generator"]["name"] == GENERATOR
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _replace(partial: Path, folder: Path) -> None:
    if not folder.exists():
        os.replace(partial, folder)
        return
    old = partial.with_suffix(".old")
    os.replace(folder, old)
    try:
        os.replace(partial, folder)
    except OSError:
        os.replace(old, folder)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _remove_abandoned(parent: Path) -> None:
    """Remove what exports of processes that were killed have left here."""
    with suppress(OSError):
        for path in parent.iterdir():
            found = _ABANDONED.fullmatch(path.name)
            if found is not None and not process_lives(int(found[1])):
                shutil.rmtree(path, ignore_errors=True)


def _sentence(problem: OSError, folder: Path) -> str:
    if problem.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"The disk is full: free some space or choose another folder than {folder}."
    if problem.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"{folder} cannot be written: choose a folder you may write to."
    return f"{folder} cannot be written ({problem.strerror or problem}): choose another folder."
