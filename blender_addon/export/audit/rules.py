# SPDX-License-Identifier: GPL-3.0-or-later
"""What an export does with the properties of one kind of owner, and the sentences about those it leaves out."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..findings import Findings


@dataclass(frozen=True)
class Named:
    """A property that changes Cycles' picture and not ours, unless it has the value `neutral`.

    `{owner}` in the sentence stands for the owner's name. With `stops` the fit would be wrong and is refused.
    """

    neutral: Any
    sentence: str
    stops: bool = False


@dataclass(frozen=True)
class Owner:
    """All properties of one RNA type: words separated by spaces, and the named ones.

    Attributes
    ----------
    exported
        Those that the export reads, or names where it meets them in the scene.
    no_effect
        Those that change nothing in the mean of Cycles' picture: the interface, other engines, noise and speed.
    named
        Those that `name_settings` looks at.
    """

    exported: str = ""
    no_effect: str = ""
    named: Mapping[str, Named] = field(default_factory=dict)

    @property
    def known(self) -> frozenset[str]:
        """The names of all properties in this table."""
        return frozenset((*self.exported.split(), *self.no_effect.split(), *self.named))


def name_settings(table: Owner, owner: Any, name: str, findings: Findings, idle: Container[str] = ()) -> None:
    """Report each named property of `owner` (None: nothing) that this Blender has and that is not neutral.

    Those in `idle` change nothing in this scene.
    """
    for key, rule in table.named.items():
        value = getattr(owner, key, rule.neutral)
        if value == rule.neutral or key in idle:
            continue
        report = findings.error if rule.stops else findings.note
        report(rule.sentence.format(owner=name))
