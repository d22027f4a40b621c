# SPDX-License-Identifier: Apache-2.0
"""The errors a user can meet. Each message is one sentence: what was given, what is allowed, what to do."""

from __future__ import annotations

from .status import Status


class MfoError(Exception):
    """Base of all errors that are reported to the user without a traceback."""

    status = Status.FAILED


class BadInputError(MfoError):
    """A file, name or value given by the user cannot be used."""

    status = Status.BAD_INPUT


class SetupError(MfoError):
    """Something outside the job is missing: a package, LLVM, a Blender program."""

    status = Status.SETUP


def first_line(error: Exception) -> str:
    """What an error says that is not meant for the user, without further lines: at most 200 letters."""
    return str(error).strip().split("\n")[0][:200]


class NoNearerError(Exception):  # of a trial, which no user meets
    """A fit from another class of material stopped early: it would not come nearer than the result that there is."""

    def __init__(self, seconds: float, passes: float) -> None:
        super().__init__("The first stages came no nearer.")
        self.seconds, self.passes = seconds, passes


class UnrecordableError(BadInputError):
    """The target's material or scene is none that recorded light paths can hold; the preset `paper` can."""
