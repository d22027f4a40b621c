# SPDX-License-Identifier: Apache-2.0
"""The events of many fits as those of one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from ...types.event import BestValues, Event, Listener, Progress, StageEnd, Started

# Parts of the whole that the first and the second round take, and all after them: 19, 26 and 7 seconds of processor
# time in a room of six materials with the preset `balanced`
SHARES = (0.36, 0.5, 0.14)


class WholeCourse:
    """Tells a listener of fits that follow each other; stages are named after their materials."""

    def __init__(self, names: Sequence[str], listener: Listener, shares: Sequence[float] = SHARES) -> None:
        self._names, self._listener = list(names), listener
        self._shares = [share / sum(shares) for share in shares]
        self._began, self._started, self._done = time.monotonic(), False, set[tuple[int, int]]()

    def of(self, member: int, round_number: int) -> Listener:
        """The listener for the fit of one of them in a round, counted from 1."""
        self._done.add((member, round_number))
        before = sum(1 for _, number in self._done if number == round_number) - 1
        part = min(round_number, len(self._shares)) - 1
        beginning = sum(self._shares[:part])

        def heard(event: Event) -> None:
            if isinstance(event, Started):
                if not self._started:
                    self._started = True
                    self._listener(event)
            elif isinstance(event, Progress):
                share = min((before + event.fraction) / len(self._names), 1.0)
                whole = beginning + self._shares[part] * share
                seconds = time.monotonic() - self._began
                left = seconds * (1.0 - whole) / max(whole, 1e-3)
                self._listener(
                    replace(event, stage=self._name(member, event.stage), fraction=whole, seconds=seconds,
                            remaining_seconds=left)
                )  # fmt: skip
            elif isinstance(event, StageEnd):
                self._listener(replace(event, stage=self._name(member, event.stage)))
            elif not isinstance(event, BestValues):  # of one material they are no result of all
                self._listener(event)

        return heard

    def _name(self, member: int, stage: str) -> str:
        return f"{self._names[member]}: {stage}"
