# SPDX-License-Identifier: Apache-2.0
"""Points that fill a square or cube more evenly than random ones, for every run of them.

Kronecker sequences: multiples of irrational steps, modulo 1 (M. Roberts, "The Unreasonable Effectiveness of Quasirandom
Sequences", 2018: powers of the inverse of the generalised golden ratio). Shifted at random (R. Cranley, T. Patterson,
"Randomization of Number Theoretic Methods for Multiple Integration", 1976) each point is uniform, so sums stay
unbiased.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory


def even_points(dimensions: int, number: mi.UInt32, block: mi.UInt32, blocks: int, seed: int) -> list[mi.Float]:
    """Coordinates in [0, 1) of points `number` of the sequence, each `block` below `blocks` with a shift of its own."""
    rng = np.random.default_rng([seed, dimensions])
    shifts = rng.integers(0, 2**32, (dimensions, blocks), dtype=np.uint32)
    # the multiples wrap modulo 2^32, so that no digit is lost
    words = (
        number * dr.opaque(mi.UInt32, step) + dr.gather(mi.UInt32, own_memory(shift, mi.UInt32), block)
        for step, shift in zip(_steps(dimensions), shifts, strict=True)
    )
    # 24 bits fill a float32 and stay below 1
    return [mi.Float(word >> 8) * 2.0**-24 for word in words]


def _steps(dimensions: int) -> list[int]:
    """The steps times 2^32: powers of 1 / g, where g^(d + 1) = g + 1."""
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    return [int(2**32 * g**-k % 2**32) | 1 for k in range(1, dimensions + 1)]
