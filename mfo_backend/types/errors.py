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


class UnrecordableError(BadInputError):
    """The target's material or scene is none that recorded light paths can hold; the preset `paper` can."""
