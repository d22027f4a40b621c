# SPDX-License-Identifier: Apache-2.0
"""How much a fit on traced paths does."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TransmissionPlan:
    """How much a fit on traced paths does.

    `*_pixels` bounds the pixels a stage looks at, `*_samples` are paths a pixel in each of the two halves and
    `polish_paths` those of all pixels, `counted_paths` the most of them where a noisy reference is compared at equal
    counts (`fit/equal_counts.py`); `race_steps` and `polish_steps` bound the iterations, `starts` the nodes that
    race, besides the scene's own material. The polish ends when the error that is left is expected to be below the
    share `enough` of the reference's noise (squares; 0.02 is one per cent of the root). Under a very noisy reference
    an eye may see such an error; one above `unseen` (relative) has to be the reference's doing, too, not our own.
    """

    scan_pixels: int = 500
    scan_samples: int = 4
    scan_steps: int = 2
    starts: int = 2
    race_pixels: int = 1500
    race_samples: int = 8
    race_steps: int = 7
    coat_pixels: int = 4000
    polish_pixels: int = 16_000
    polish_paths: int = 20_000
    polish_steps: int = 32
    counted_paths: int = 1 << 18
    guard_samples: int = 4
    enough: float = 0.005
    unseen: float = 0.04
