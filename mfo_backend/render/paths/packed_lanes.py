# SPDX-License-Identifier: Apache-2.0
"""Recorded lanes in the order in which a kernel reads them."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory
from .recorded_paths import LaneGroups, RecordedPaths

BLOCK = 16  # lanes of a kernel that walk side by side: floats of a cache line, and of the widest vector registers
READ_BEFORE = 1  # times that lanes are read as they were recorded: packing takes about as long as reading them once


@dataclass(frozen=True)
class Lanes:
    """Lanes, and which of them each lane of a kernel reads: `start`, then `step` further, before `stop`.

    `arrays` are directions to camera and light, weights, values that textures give, and light that returns.
    """

    arrays: tuple[Any, ...]
    start: mi.UInt32
    stop: mi.UInt32
    step: mi.UInt32

    @staticmethod
    def as_recorded(paths: RecordedPaths, groups: LaneGroups, held: Sequence[str] = ()) -> Lanes:
        """Those of `groups` where they are in the recording, with the values `held` by name."""
        start, stop, _ = groups.parts
        arrays = (paths.wi, paths.wo, paths.weight, *(paths.held[name] for name in held))
        returned = () if paths.returned is None else (paths.returned.weight,)
        return Lanes((*arrays, *returned), start, stop, dr.opaque(mi.UInt32, 1))


class LaneReader:
    """Where to read the same lanes again and again.

    A kernel lane reads one recorded lane after the other, and its neighbours in a vector register begin somewhere else
    each, so every load goes to as many cache lines as there are neighbours. What is read again is packed: those that
    are read at once lie side by side. It is the same sum in the same order.
    """

    def __init__(self, lanes: Lanes) -> None:
        self._lanes, self._read = lanes, 0

    def __call__(self) -> Lanes:
        """Where they are this time."""
        if self._read == READ_BEFORE:
            self._lanes = packed(self._lanes)
        self._read += 1
        return self._lanes


def packed(lanes: Lanes) -> Lanes:
    """The same lanes in blocks of `BLOCK` runs, which are read side by side; shorter runs leave gaps."""
    start, stop = lanes.start.numpy().astype(np.int64), lanes.stop.numpy().astype(np.int64)
    runs = np.arange(len(start))
    longest = np.maximum.reduceat(stop - start, runs[::BLOCK])
    first = BLOCK * (np.cumsum(longest) - longest)
    begin = first[runs // BLOCK] + runs % BLOCK
    size, step = int(BLOCK * longest.sum()), dr.opaque(mi.UInt32, BLOCK)
    to_start, to_stop = (own_memory(a, mi.UInt32) for a in (begin, begin + BLOCK * (stop - start)))
    copies = tuple(dr.zeros(type(array), size) for array in lanes.arrays)
    dr.eval(copies, to_start, to_stop)

    def body(source, stop, target):
        for array, copy in zip(lanes.arrays, copies, strict=True):
            dr.scatter(copy, dr.gather(type(array), array, source), target, mode=dr.ReduceMode.Permute)
        return source + 1, stop, target + step

    state = (mi.UInt32(lanes.start), mi.UInt32(lanes.stop), mi.UInt32(to_start))
    dr.while_loop(state, lambda source, stop, target: source < stop, body, label="pack lanes")
    dr.eval(copies)
    return Lanes(copies, to_start, to_stop, step)
