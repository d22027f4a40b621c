# SPDX-License-Identifier: Apache-2.0
"""Independent work on the processors there are: NumPy lets other threads go on while it computes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

from ..types.processors import processors, threads_wanted

Item = TypeVar("Item")
Result = TypeVar("Result")


def side_by_side(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    """`function` of each item, in order; as many at a time as there are processors, or `MFO_THREADS`.

    No more results are held than are computed at a time. The first error is raised.
    """
    threads = threads_wanted() or processors()
    if threads == 1 or len(items) < 2:
        yield from map(function, items)
        return
    for begin in range(0, len(items), threads):
        yield from _pool(threads).map(function, items[begin : begin + threads])


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="mfo-metric")
