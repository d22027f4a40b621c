# SPDX-License-Identifier: Apache-2.0
"""Random numbers that a path keeps, whatever the material along it does. Choose the variant before importing this."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mitsuba as mi


@dataclass(frozen=True)
class PathRandom:
    """Random numbers by path and place, without a state: a path keeps its numbers whatever the material does."""

    a: mi.UInt32
    b: mi.UInt32

    @staticmethod
    def of(path: mi.UInt32, seed: mi.UInt32) -> PathRandom:
        """Those of a path number and a seed."""
        return PathRandom(*mi.sample_tea_32(path, seed, 6))

    def pair(self, place: Any) -> mi.Point2f:
        """Two numbers in [0, 1) (D. Wheeler and R. Needham, TEA, 1994, as a hash)."""
        x, y = mi.sample_tea_32(self.a, self.b + mi.UInt32(place) * 0x9E3779B9, 5)
        return mi.Point2f(mi.Float(x >> 8), mi.Float(y >> 8)) * 2.0**-24
