# SPDX-License-Identifier: Apache-2.0
"""A renderer that answers a request to stop within half a second, however long one of its pictures takes."""

from __future__ import annotations

import queue
import threading
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels
from .renderer import Interrupted, Pullback, Renderer, Vector

T = TypeVar("T")
_Calls = queue.SimpleQueue[Callable[[], None] | None]
POLL_SECONDS = 0.05  # how often a waiting call looks for the request
PATIENCE_SECONDS = 0.3  # a picture that is nearly done may finish; the rest of the promised second is for the result


class NativeThread:
    """One thread that does all native work: Mitsuba's variant belongs to the thread that set it.

    The kernels release Python's lock while they compile and run (Dr.Jit 1.5.0: measured gaps of at most 0.4 s), so
    the caller can give up on them. An abandoned thread is never joined; the process ends with `os._exit`.
    """

    def __init__(self, should_stop: Callable[[], bool]) -> None:
        self._should_stop = should_stop
        self._calls: _Calls = queue.SimpleQueue()
        threading.Thread(target=_work, args=(self._calls,), name="mfo-native", daemon=True).start()
        weakref.finalize(self, self._calls.put, None)  # a process of many fits would keep a thread for each

    def call(self, function: Callable[[], T]) -> T:
        """The function's result or error.

        Raises
        ------
        Interrupted
            If the job was asked to stop and the function does not return soon.
        """
        done = threading.Event()
        outcome: list[Any] = []

        def run() -> None:
            try:
                outcome.extend((True, function()))
            except BaseException as error:
                outcome.extend((False, error))
            done.set()

        self._calls.put(run)
        asked = 0.0
        while not done.wait(POLL_SECONDS):
            if self._should_stop():
                asked += POLL_SECONDS
                if asked > PATIENCE_SECONDS:
                    raise Interrupted
        succeeded, value = outcome
        if not succeeded:
            raise value
        return value


def _work(calls: _Calls) -> None:
    while (call := calls.get()) is not None:
        call()
        del call  # it holds the renderer, and this waits for the next one


class InterruptibleRenderer:
    """The `Renderer` protocol with every call on a `NativeThread`."""

    def __init__(self, renderer: Renderer, thread: NativeThread) -> None:
        self.model, self.table, self.start = renderer.model, renderer.table, renderer.start
        self.counter = renderer.counter
        self.sheet = getattr(renderer, "sheet", None)
        self._renderer = renderer
        self._thread = thread

    @property
    def passes(self) -> float:
        """See `Renderer.passes`."""
        return self.counter.count

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer.image`."""
        return self._call(lambda: self._renderer.image(vector, seed=seed, spp=spp))

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`."""
        image, pullback = self._call(lambda: self._renderer.image_and_pullback(vector, seed=seed, spp=spp))
        return image, lambda gradient: self._call(lambda: pullback(gradient))

    def target_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.target_mask`."""
        return self._call(self._renderer.target_mask)

    def otherwise_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.otherwise_mask`."""
        return self._call(self._renderer.otherwise_mask)

    def _call(self, function: Callable[[], T]) -> T:
        return self._thread.call(function)
