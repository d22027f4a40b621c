# SPDX-License-Identifier: GPL-3.0-or-later
"""Results that outlive the file they were made in: on a shelf until that file is saved, and back when it is opened.

A fit costs minutes, and a history is saved with its .blend alone. So what a fit of a saved file has found is not lost
with another file, a revert, the end of Blender or its crash.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import bpy

from ..backend.preferences import shelf_folder
from ..process.job_process import keep_best
from ..result import history, shelf
from ..result.job_result import JobResult, JobResultError, read_job_result, result_folders
from ..result.local_copy import unwritable
from ..result.write_back import WriteBackError


def keep(job: Path) -> None:
    """Note that a job belongs to the open file; one that was never saved has no name to be found by."""
    if bpy.data.filepath:
        with suppress(OSError):  # the fit is worth more than the note of it
            shelf.put(shelf_folder(), bpy.data.filepath, job)


def forget(job: Path) -> None:
    """The job has no result, or the user does not want it."""
    shelf.take_off(shelf_folder(), job)


def saved(running: Sequence[Path]) -> None:
    """The open file was written: what its materials have in their histories is in it; `running` jobs are its own."""
    kept = [
        Path(entry.job_folder) for material in bpy.data.materials if material.users for entry in material.mfo.history
    ]
    for shelved in shelf.of(shelf_folder(), bpy.data.filepath):
        if any(folder.is_relative_to(shelved.job) for folder in kept):  # of several materials it holds one for each
            forget(shelved.job)
    for job in running:
        keep(job)


def restore() -> list[str]:
    """Put what waits for the open file into the histories of its materials; returns what is to be said of it.

    It waits on until the file is saved with it.
    """
    found: list[JobResult] = []
    lost: list[str] = []
    for shelved in shelf.of(shelf_folder(), bpy.data.filepath) if bpy.data.filepath else ():
        if shelved.may_run:
            continue
        keep_best(shelved.job)
        try:
            results = [read_job_result(path) for path in result_folders(shelved.job)]
        except JobResultError:
            forget(shelved.job)  # it ended before it had found anything
            continue
        there = [result for result in results if _record(result)]
        if not there:
            forget(shelved.job)
            names = ", ".join(result.material_name for result in results)
            lost.append(f"A result that was not saved is of {names}, which this file does not have: {shelved.job}")
        found += there
    if not found:
        return lost
    names = ", ".join(dict.fromkeys(result.material_name for result in found))
    return [f"The history of {names} has results that were not saved: save the file to keep them.", *lost]


def _record(result: JobResult) -> bool:
    """Whether the result is in the history of its material now."""
    material = bpy.data.materials.get(result.material_name)
    if material is None or unwritable(material):
        return False
    with suppress(WriteBackError):
        if all(entry.job_folder != str(result.folder) for entry in material.mfo.history):
            history.record(material, result)
        return True
    return False
