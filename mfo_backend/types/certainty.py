# SPDX-License-Identifier: Apache-2.0
"""How well a picture determines a value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from .parameter import socket_name


class Level(Enum):
    """How sure a recovered value is."""

    DETERMINED = "determined"
    WEAK = "weak"
    NOT_VISIBLE = "not_visible"  # and kept as in the scene
    NOT_TOLD_APART = "not_told_apart"  # changed, together with others whose effect looks alike
    DOUBTFUL = "doubtful"  # well determined if the picture were matched, which it is not


@dataclass(frozen=True)
class Certainty:
    """Standard deviation of each component of a value, in the value's own unit, and what it means.

    `along` names the values that this one can be traded against, most of all first, and `shown` is what a user calls
    them.
    """

    sd: tuple[float, ...]
    level: Level
    along: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The level for a user."""
        if self.level is Level.NOT_TOLD_APART and self.along:
            return f"not told apart from {', '.join(self.shown or map(socket_name, self.along))}"
        return _WORDS[self.level]


_WORDS = {
    Level.DETERMINED: "determined",
    Level.WEAK: "weakly determined",
    Level.NOT_VISIBLE: "not visible, kept",
    Level.NOT_TOLD_APART: "changed, hardly visible",
    Level.DOUBTFUL: "doubtful, as the picture is not matched",
}


@dataclass(frozen=True)
class WeakCombination:
    """Values that a picture determines together only: a step along them it would hardly show, and that as a sentence.

    A colour's step is the mean of its channels'.
    """

    parameters: tuple[str, ...]
    step: dict[str, float]
    sentence: str
