# SPDX-License-Identifier: GPL-3.0-or-later
"""One line of the check before a run."""

from __future__ import annotations

from dataclasses import dataclass

from ..export.findings import Fix

FINE, IGNORED, TO_CHOOSE, STOPS = "fine", "ignored", "to_choose", "stops"
REFUSED = (STOPS, TO_CHOOSE)  # a fit does not start with any of these


@dataclass(frozen=True)
class Finding:
    """One line of the check: a level, a sentence, and what one press could do about it.

    `of_all` says that it is not of one material: it stops whatever is fitted.
    """

    level: str
    sentence: str
    fixes: tuple[Fix, ...] = ()
    of_all: bool = False


def first_refused(findings: tuple[Finding, ...], *, of_all: bool = False) -> str:
    """The first sentence that keeps a fit from starting, or of those `of_all`; empty where nothing does."""
    return next((f.sentence for f in findings if f.level in REFUSED and (f.of_all or not of_all)), "")
