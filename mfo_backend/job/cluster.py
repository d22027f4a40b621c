# SPDX-License-Identifier: Apache-2.0
"""Work spread over processes or machines with Dask; `docs/user/cluster.md` says how to start one.

Dask's messages hold pickles: a scheduler trusts everyone who can reach it.
"""

from __future__ import annotations

import logging
import queue
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ..types.errors import BadInputError, SetupError
from ..types.processors import processors

RETRIES = 2  # of work that raises; a lost worker's work goes to another one without counting here
LOOK_SECONDS = 0.2
NO_WORKER_SECONDS = 120.0  # a cluster may take this long to replace one
# after which workers are added to a cluster of our own: a nanny of Dask (2026.8.0) does not replace one that died while
# it started. Larger: a longer wait after that. Smaller: busy cores start workers that were not needed
RENEW_SECONDS = 20.0
_CONNECT_SECONDS = 15


def threads_each(workers: int) -> int:
    """Threads of each of some workers on one machine."""
    return max(1, processors() // workers)


@contextmanager
def open_client(scheduler: str | None, workers: int) -> Iterator[Any]:
    """A Dask client of a running scheduler, or of `workers` processes on this machine that end with the block.

    Raises
    ------
    SetupError
        If the extra `cluster` is not installed.
    BadInputError
        If nothing answers at the scheduler's address.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise SetupError(f"Dask cannot be imported ({error}): install distributed (the extra `cluster`).") from None
    for name in (
        "distributed",
        "distributed.client",
        "distributed.worker",
        "distributed.nanny",
        "distributed.scheduler",
    ):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # a lost worker is told once, by us
    if scheduler is None:
        quiet: dict[str, Any] = {"dashboard_address": None, "silence_logs": logging.CRITICAL}
        # one task at a time: Mitsuba's variant and its scenes belong to one thread
        with LocalCluster(n_workers=workers, threads_per_worker=1, **quiet) as cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(scheduler, timeout=_CONNECT_SECONDS)
    except (OSError, ValueError) as error:
        words = " ".join(str(error).split())
        raise BadInputError(
            f"No Dask scheduler answers at {scheduler!r} ({words}): check address and network."
        ) from None
    with client:
        yield client


@dataclass(frozen=True)
class Outcome:
    """What came of a piece of work: its result, or the exception that it ended with."""

    result: Any = None
    error: BaseException | None = None


def as_they_come(
    client: Any, futures: Mapping[Any, Any], should_stop: Callable[[], bool]
) -> Iterator[tuple[Any, Outcome]]:
    """(key, outcome) of every future that has ended, in the order of their ends; stops early when asked to.

    Raises
    ------
    SetupError
        If there has been no worker for two minutes, or the scheduler is gone.
    """
    ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
    keys = {future.key: name for name, future in futures.items()}
    for future in futures.values():
        future.add_done_callback(ended.put)
    left, alive, renewed, crew = len(futures), time.monotonic(), False, 1
    lost: list[Any] = []  # whose result was on a worker that died: Dask computes them again
    while left and not should_stop():
        try:
            future = ended.get(timeout=LOOK_SECONDS)
        except queue.Empty:
            if workers := client.scheduler_info()["workers"]:
                alive, renewed, crew = time.monotonic(), False, max(crew, len(workers))
            elif time.monotonic() - alive > RENEW_SECONDS and client.cluster is not None and not renewed:
                client.cluster.scale(len(client.cluster.worker_spec) + crew)  # those that are gone stay in it
                renewed = True
            elif time.monotonic() - alive > NO_WORKER_SECONDS:
                raise SetupError(
                    "No Dask worker is left: start workers, then the same command goes on where it was."
                ) from None
            again, lost = lost, []
            for future in again:
                ended.put(future)
            continue
        outcome = _outcome(future)
        if outcome is None:
            lost.append(future)
            continue
        left -= 1
        yield keys[future.key], outcome


def _outcome(future: Any) -> Outcome | None:
    """The outcome of a future that ended once, or None while it is computed again.

    A worker may die between any two looks at a future, so its status decides nothing: only what it hands over does.

    Raises
    ------
    SetupError
        If the scheduler is gone.
    """
    try:
        error = future.exception(timeout=LOOK_SECONDS)
        return Outcome(error=error) if error is not None else Outcome(future.result(timeout=_CONNECT_SECONDS))
    except TimeoutError:
        return None
    except CancelledError:  # nothing came of it, and it is nobody's error
        raise SetupError("The Dask scheduler is gone: start it, then the same command goes on where it was.") from None
    except Exception as error:  # computed again, it ended otherwise; or its result cannot be read
        return Outcome(error=error)
