# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits that wait for their turn, each an exported job folder, and how those before them ended. No bpy here."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

LINES = 8  # of fits that ended; the panel shows no more


@dataclass(frozen=True)
class PreparedFit:
    """A job folder and who it is for; `is_new`: the folder was made for it, so it may go if the fit never starts.

    Of materials that are fitted together `uids` has the session_uid of each, else of the one.
    """

    python: Path
    folder: Path
    material_name: str
    uids: tuple[int, ...]
    notes: tuple[str, ...]
    is_new: bool


@dataclass(frozen=True)
class EndedFit:
    """A fit of the queue that has ended: a sentence, and the icon of its verdict."""

    material_name: str
    sentence: str
    icon: str


waiting: list[PreparedFit] = []
finished: list[EndedFit] = []
_running = False  # there was something in the queue since it was last empty


def add(fit: PreparedFit) -> None:
    """Put a fit at the end."""
    global _running
    if not _running:
        finished.clear()
    _running = True
    waiting.append(fit)


def begin() -> None:
    """A fit starts that did not wait: what is told of an earlier queue is old."""
    if not _running:
        finished.clear()


def take() -> PreparedFit | None:
    """The next fit, no longer waiting; None if there is none."""
    global _running
    if not waiting:
        _running = False
        return None
    return waiting.pop(0)


def waits(uid: int) -> bool:
    """Whether a fit of that material alone waits."""
    return any(fit.uids == (uid,) for fit in waiting)


def give_way(uid: int) -> None:
    """Drop what waits of that material alone: a newer fit of it is prepared."""
    for index in reversed([index for index, fit in enumerate(waiting) if fit.uids == (uid,)]):
        drop(index)


def drop(index: int) -> None:
    """Take a waiting fit out and remove the folder that was made for it."""
    fit = waiting.pop(index)
    if fit.is_new:
        shutil.rmtree(fit.folder, ignore_errors=True)


def ended(material_name: str, sentence: str, icon: str) -> None:
    """Remember how a fit ended, as long as there is a queue."""
    if _running:
        finished.append(EndedFit(material_name, sentence, icon))
        del finished[:-LINES]


def refused(fit: EndedFit) -> None:
    """Remember a fit that never began, beside those that did."""
    finished.append(fit)
    del finished[:-LINES]


def clear() -> None:
    """Forget all fits, those that wait and those that ended."""
    global _running
    while waiting:
        drop(0)
    finished.clear()
    _running = False
