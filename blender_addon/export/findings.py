# SPDX-License-Identifier: GPL-3.0-or-later
"""What an export found out: sentences for the user, gathered while the scene is read."""

from __future__ import annotations

from dataclasses import dataclass, field


class ExportError(Exception):
    """The scene cannot be exported; the message is one sentence for the user."""


@dataclass
class Findings:
    """Errors (the fit would be wrong) and notes (ignored or approximated), each sentence once, in order."""

    errors: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def error(self, sentence: str) -> None:
        """Remember that the export must not go on, and why."""
        if sentence not in self.errors:
            self.errors.append(sentence)

    def note(self, sentence: str) -> None:
        """Remember what was left out or approximated."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def raise_first(self) -> None:
        """Raise the first error.

        Raises
        ------
        ExportError
            If anything was reported with `error`.
        """
        if self.errors:
            raise ExportError(self.errors[0])
