# SPDX-License-Identifier: Apache-2.0
"""Damaged copies of a file, drawn from a generator: for the pass without a coverage-guided fuzzer."""

from __future__ import annotations

import numpy as np

_NUMBERS = (b"\0", b"\1", b"\x7f", b"\x80", b"\xff", b"\0\0\0\0", b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff")


def mutated(seed: bytes, words: tuple[bytes, ...], rng: np.random.Generator) -> bytes:
    """`seed` after one to eight changes: bytes set, blocks cut, doubled or moved, words put in."""
    data = bytearray(seed)
    for _ in range(int(rng.integers(1, 9))):
        at, length = int(rng.integers(0, len(data) + 1)), int(rng.integers(1, 17))
        kind = int(rng.integers(0, 6))
        if kind == 0 and at < len(data):
            data[at] = int(rng.integers(0, 256))
        elif kind == 1:
            del data[at : at + length]
        elif kind == 2:
            data[at:at] = data[at : at + length] * int(rng.integers(1, 9))
        elif kind == 3:
            pool = (*words, *_NUMBERS)
            data[at : at + length] = pool[int(rng.integers(0, len(pool)))]
        elif kind == 4:
            other = int(rng.integers(0, len(data) + 1))
            data[at:at] = data[other : other + length]
        elif len(data) > 1:
            del data[max(at, 1) :]
    return bytes(data)
