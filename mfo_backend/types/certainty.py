# SPDX-License-Identifier: Apache-2.0
"""How well a picture determines a value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Level(Enum):
    """How sure a recovered value is."""

    DETERMINED = "determined"
    WEAK = "weak"
    NOT_VISIBLE = "not_visible"


@dataclass(frozen=True)
class Certainty:
    """Standard deviation of each component of a value, in the value's own unit, and what it means."""

    sd: tuple[float, ...]
    level: Level


@dataclass(frozen=True)
class WeakCombination:
    """Values that a picture determines together only: a step along them it would hardly show, and that as a sentence.

    A colour's step is the mean of its channels'.
    """

    parameters: tuple[str, ...]
    step: dict[str, float]
    sentence: str
