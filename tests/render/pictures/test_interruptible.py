# SPDX-License-Identifier: Apache-2.0
"""Giving up on native work that does not return, and a fit that keeps its best values then."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from mfo_backend.fit.paper.loop import run_stage
from mfo_backend.render.pictures.interruptible import InterruptibleRenderer, NativeThread
from mfo_backend.render.pictures.pass_counter import PassCounter
from mfo_backend.render.pictures.renderer import Interrupted
from mfo_backend.solve.adam import Adam
from mfo_backend.solve.stopping import StoppingRules
from mfo_backend.types.parameter import Parameter, ParameterTable
from mfo_backend.types.status import Status

NEVER = 3600.0  # seconds that no test waits for: a call that is not given up runs into the time limit of its test


class Grey:
    """A picture of one grey pixel; the call number `slow` takes an hour."""

    model = "grey"
    table = ParameterTable([Parameter("grey", 1, 0.0, 1.0, 0.5)])
    start = np.array([0.9])

    def __init__(self, slow: int, where: str = "image") -> None:
        self.counter, self.calls, self.slow, self.where = PassCounter(), 0, slow, where
        self.threads: set[int] = set()
        self.asked = threading.Event()

    @property
    def passes(self):
        return self.counter.count

    def image(self, vector, *, seed, spp):
        self.threads.add(threading.get_ident())
        self.calls += 1
        self.counter.add(1.0)
        self.wait("image")
        return np.full((1, 1, 3), vector[0], np.float32)

    def image_and_pullback(self, vector, *, seed, spp):
        def pullback(gradient):
            self.threads.add(threading.get_ident())
            self.wait("pullback")
            return np.array([gradient.sum()], np.float64)

        return self.image(vector, seed=seed, spp=spp), pullback

    def target_mask(self):
        return np.ones((1, 1), bool)

    def wait(self, where: str) -> None:
        if self.calls == self.slow and where == self.where:
            self.asked.set()  # someone cancels now
            time.sleep(NEVER)


def test_the_thread_ends_with_its_last_user() -> None:
    thread = NativeThread(lambda: False)
    native = thread.call(threading.current_thread)
    assert native.is_alive()
    del thread
    native.join(5.0)
    assert not native.is_alive()


def test_results_and_errors_come_through() -> None:
    thread = NativeThread(lambda: False)
    assert thread.call(lambda: 7) == 7
    with pytest.raises(ZeroDivisionError):
        thread.call(lambda: 1 / 0)
    assert thread.call(threading.get_ident) == thread.call(threading.get_ident) != threading.get_ident()


def test_work_that_is_nearly_done_may_finish() -> None:
    assert NativeThread(lambda: True).call(lambda: time.sleep(0.1) or "done") == "done"


def test_work_that_does_not_return_is_abandoned() -> None:
    with pytest.raises(Interrupted):
        NativeThread(lambda: True).call(lambda: time.sleep(NEVER))


def test_a_renderer_is_the_same_on_its_thread() -> None:
    grey = Grey(slow=-1)
    renderer = InterruptibleRenderer(grey, NativeThread(lambda: False))
    image, pullback = renderer.image_and_pullback(np.array([0.25]), seed=0, spp=1)
    assert image[0, 0].tolist() == [0.25, 0.25, 0.25]
    assert pullback(np.ones((1, 1, 3), np.float32)).tolist() == [3.0]
    assert renderer.target_mask().all()
    assert renderer.passes == grey.passes == 1.0
    assert len(grey.threads) == 1
    assert threading.get_ident() not in grey.threads


@pytest.mark.parametrize("where", ["image", "pullback"])
def test_a_stage_keeps_its_best_values_when_interrupted(where: str) -> None:
    grey = Grey(slow=5, where=where)
    renderer = InterruptibleRenderer(grey, NativeThread(grey.asked.is_set))
    steps = []
    status, best = run_stage(
        renderer,
        lambda image: (float(np.square(image).mean()), 2 * image / image.size),
        grey.start,
        Adam(grey.table.lower, grey.table.upper, 0.02),
        rules=StoppingRules(patience=10, max_iterations=50),
        levels=1,
        seed=0,
        spp=1,
        on_step=steps.append,
        should_stop=grey.asked.is_set,
    )
    assert status is Status.CANCELLED
    assert len(steps) == (4 if where == "image" else 5)
    assert np.square(best.image).mean() == min(step.loss for step in steps)
    assert best.vector[0] < grey.start[0]  # the loss is the square of the grey, so every step lowers it
