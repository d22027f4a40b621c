# SPDX-License-Identifier: Apache-2.0
"""Oracle: `map`, and a barrier that no thread passes alone."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from mfo_backend.metrics.flip.hdr_flip import HdrFlip
from mfo_backend.metrics.pixels.side_by_side import side_by_side


@pytest.mark.parametrize("threads", ["1", "2", "3"])
@pytest.mark.parametrize("count", [0, 1, 5])
def test_results_come_in_order(monkeypatch, threads, count):
    monkeypatch.setenv("MFO_THREADS", threads)
    assert list(side_by_side(lambda k: k * k, range(count))) == [k * k for k in range(count)]


def test_as_many_run_at_a_time_as_threads_are_allowed(monkeypatch):
    monkeypatch.setenv("MFO_THREADS", "2")
    both = threading.Barrier(2, timeout=20.0)
    assert sorted(side_by_side(lambda _: both.wait(), range(4))) == [0, 0, 1, 1]


def test_one_thread_is_the_callers(monkeypatch):
    monkeypatch.setenv("MFO_THREADS", "1")
    assert set(side_by_side(lambda _: threading.get_ident(), range(3))) == {threading.get_ident()}


@pytest.mark.parametrize("threads", ["1", "2"])
def test_the_first_error_is_raised(monkeypatch, threads):
    monkeypatch.setenv("MFO_THREADS", threads)
    with pytest.raises(ZeroDivisionError):
        list(side_by_side(lambda k: 1 // (k - 1), range(3)))


def test_hdr_flip_has_the_same_bits_with_any_threads(monkeypatch):
    rng = np.random.default_rng(5)
    reference = np.exp(rng.normal(size=(40, 56, 3))).astype(np.float32)
    test = (reference * rng.uniform(0.7, 1.3, reference.shape)).astype(np.float32)
    found = []
    for threads in ("1", "2", "3"):
        monkeypatch.setenv("MFO_THREADS", threads)
        found.append((HdrFlip(reference).map(test), *HdrFlip(reference).map_and_pullback(test, 1.0)))
    for other in found[1:]:
        for one, again in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, again)
