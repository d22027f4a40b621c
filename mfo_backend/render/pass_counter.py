# SPDX-License-Identifier: Apache-2.0
"""What a fit has cost so far, in renders of one full picture."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class PassCounter:
    """Counts passes: a pass is one render of a full picture, and whatever a fit does is a number of them.

    A renderer has one counter, which everything that renders for it shares.
    """

    def __init__(self) -> None:
        self.count = 0.0
        self._closed = 0

    def add(self, passes: float) -> None:
        """Count so many more, unless that is switched off."""
        if not self._closed:
            self.count += passes

    @contextmanager
    def uncounted(self) -> Iterator[None]:
        """Count nothing meanwhile: for what is no part of a fit, such as its previews."""
        self._closed += 1
        try:
            yield
        finally:
            self._closed -= 1
