# SPDX-License-Identifier: GPL-3.0-or-later
"""What an export found out: sentences for the user, gathered while the scene is read."""

from __future__ import annotations

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Fix:
    """What one press could mend: a key of `mending.KINDS`, and what it needs to know (a name, a size).

    `of` is the object's name and the slot whose material it mends, None for the active ones.
    """

    kind: str
    argument: str = ""
    of: tuple[str, int] | None = None


class ExportError(Exception):
    """The scene cannot be exported; the message is one sentence for the user."""

    def __init__(self, sentence: str, *fixes: Fix) -> None:
        super().__init__(sentence)
        self.fixes = fixes


class NotShownError(ExportError):
    """A picture shows nothing of what is fitted."""


@dataclass
class Findings:
    """Errors (the fit would be wrong) and notes (ignored or approximated), each sentence once, in order.

    `fixes` has what one press could do about a sentence; `left_out` has the notes that may be why a result does not
    match. `of_mitsuba` says that the fit's model is mitsuba_principled.
    """

    of_mitsuba: bool = False
    errors: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    fixes: dict[str, tuple[Fix, ...]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)

    def error(self, sentence: str, *fixes: Fix) -> None:
        """Remember that the export must not go on, and why."""
        if sentence not in self.errors:
            self.errors.append(sentence)
            self.fixes[sentence] = fixes

    def note(self, sentence: str, *fixes: Fix, explains: bool = True) -> None:
        """Remember what was left out or approximated; `explains` says whether it may be why a result does not match.

        What is so in nearly every scene, and what concerns the writing of values, explains nothing.
        """
        if sentence not in self.notes:
            self.notes.append(sentence)
            self.fixes[sentence] = fixes
            if explains:
                self.left_out.append(sentence)

    def note_of_mitsuba(self, sentence: str) -> None:
        """Remember what Mitsuba's principled cannot have, where that is the fit's model."""
        if self.of_mitsuba:
            self.note(sentence)

    def take_over(self, found: Findings, of: tuple[str, int]) -> None:
        """Remember what was found of one of several materials, in this slot of the object of this name."""
        for sentence in found.errors:
            self.error(sentence, *(replace(fix, of=of) for fix in found.fixes[sentence]))
        for sentence in found.notes:
            fixes = (replace(fix, of=of) for fix in found.fixes[sentence])
            self.note(sentence, *fixes, explains=sentence in found.left_out)

    def raise_first(self) -> None:
        """Raise the first error.

        Raises
        ------
        ExportError
            If anything was reported with `error`.
        """
        if self.errors:
            raise ExportError(self.errors[0], *self.fixes[self.errors[0]])
