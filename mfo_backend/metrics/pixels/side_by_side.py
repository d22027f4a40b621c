# SPDX-License-Identifier: Apache-2.0
"""Independent work on the processors there are: NumPy lets other threads go on while it computes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from typing import TypeVar

from ...types.processors import processors, threads_wanted

Item = TypeVar("Item")
Result = TypeVar("Result")


def side_by_side(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    """`function` of each item, in order; as many at a time as there are processors, or `MFO_THREADS`.

    No more than twice as many results are held. The first error is raised. A `function` must not call this again: where
    all threads wait for others, none is left to work.
    """
    threads = threads_wanted() or processors()
    if threads == 1 or len(items) < 2:
        yield from map(function, items)
        return
    pool = _pool(threads)
    begun: deque[Future[Result]] = deque()
    try:
        for item in items:
            if len(begun) == 2 * threads:
                yield begun.popleft().result()
            begun.append(pool.submit(function, item))
        while begun:
            yield begun.popleft().result()
    finally:
        for future in begun:
            future.cancel()


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="mfo-metric")
