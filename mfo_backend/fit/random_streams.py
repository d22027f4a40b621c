# SPDX-License-Identifier: Apache-2.0
"""All random numbers of a fit: which seeds each stage renders with.

A stage that shall not have seen the numbers of another needs a stream of its own. That no two overlap is a test. Stages
that compare materials use one number again and again on purpose: what differs then is the material alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

_FITS_APART = 1009  # a prime: further than the streams of a fit are long, so that the next seed is another fit


@dataclass(frozen=True)
class Span:
    """Seeds that a stream takes: `length` of them, the first of which follows from the fit's seed s.

    It is s + first; with `spread` s * 1009 + first; with `apart` s XOR first, far from the seeds that users choose.
    """

    first: int
    length: int
    spread: bool = False
    apart: bool = False

    def seed(self, fit: int, number: int) -> int:
        """The seed of this number in the fit with the seed `fit`."""
        begin = fit ^ self.first if self.apart else (_FITS_APART * fit if self.spread else fit) + self.first
        return (begin + number) % 2**32


def _traced(first: int, length: int = 1) -> Span:
    return Span(first, length, spread=True)


class Stream(Enum):
    """The streams of one fit; their order says nothing."""

    # recorded paths, and the pictures of the paper's loop: recordings by their number
    RECORDINGS = Span(0, 16)
    # traced paths
    SCAN = _traced(1)
    RACE = _traced(2)
    RACE_MORE_PIXELS = _traced(3)
    POLISH = _traced(10, 32)  # a number for every step, as of all polishes
    COAT = _traced(45)
    POLISH_GLASS = _traced(50, 32)
    POLISH_RETURNED = _traced(100, 32)
    POLISH_RETURNED_AGAIN = _traced(150, 32)
    POLISH_COUNTED = _traced(200, 30)  # ten for every counting
    POLISH_LOBES = _traced(300, 32)
    CHOOSE = _traced(999, 4)
    CHOOSE_COUNTED = _traced(1010, 12)  # four for every counting
    RECOUNT = _traced(3000, 512)  # two at the number of the polish's first seed
    COUNT = _traced(5000, 300)  # a hundred for every counting
    # pictures
    LINEAR_PICTURES = Span(0x6F000000, 8, apart=True)
    VERIFY = Span(0x5EED0000, 1, apart=True)
    GAP = Span(0x6A500000, 2, apart=True)
    NEXT_PICTURE = Span(0x2E870000, 1, apart=True)
    TOGETHER = Span(0x70610000, 1, apart=True)  # looks at several materials between their fits
    PREVIEW = Span(0x3E710000, 1, apart=True)
    LOOK = Span(0x4C4B0000, 1, apart=True)  # between the stages of a fit from another class

    def seed(self, fit: int, number: int = 0) -> int:
        """The seed of this number in the stream of a fit with the seed `fit`.

        Raises
        ------
        ValueError
            If the stream is not so long.
        """
        if not 0 <= number < self.value.length:
            raise ValueError(f"The stream {self.name} has {self.value.length} numbers, and {number} is none of them.")
        return self.value.seed(fit, number)
