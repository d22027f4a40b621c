# SPDX-License-Identifier: Apache-2.0
"""No stage of a fit sees the random numbers of another, unless it is meant to."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.plans import TransmissionPlan
from mfo_backend.fit.random_streams import Stream
from mfo_backend.fit.traced.choose_end import GUARD_PARTS, choose_end
from mfo_backend.fit.traced.polish import COUNTED_STEPS, MOST_COUNTINGS
from mfo_backend.fit.traced.sample_count import MOST_COUNT

FITS = (0, 1, 2, 3, 7, 100, 1009, 65535, 2**31 - 1)


@pytest.mark.parametrize("fit", FITS)
def test_no_two_streams_of_a_fit_overlap(fit):
    # recorded and traced paths are never of one fit
    traced = [stream for stream in Stream if stream is not Stream.RECORDINGS]
    recorded = [stream for stream in Stream if not stream.value.spread]
    for streams in (traced, recorded):
        taken = {stream: {stream.seed(fit, n) for n in range(stream.value.length)} for stream in streams}
        assert [(a, b) for a, b in combinations(streams, 2) if taken[a] & taken[b]] == []
        assert all(len(numbers) == stream.value.length for stream, numbers in taken.items())


def test_a_number_beyond_the_end_is_refused():
    for stream in Stream:
        with pytest.raises(ValueError, match=f"{stream.name} has {stream.value.length} numbers"):
            stream.seed(0, stream.value.length)


def test_streams_are_as_long_as_their_stages():
    steps = TransmissionPlan().polish_steps
    polishes = [stream for stream in Stream if stream.name.startswith("POLISH")]
    assert all(polish.value.length >= steps for polish in polishes if polish is not Stream.POLISH_COUNTED)
    assert Stream.POLISH_COUNTED.value.length >= 10 * (MOST_COUNTINGS - 1) + COUNTED_STEPS
    assert Stream.CHOOSE.value.length == GUARD_PARTS
    assert Stream.CHOOSE_COUNTED.value.length == GUARD_PARTS * MOST_COUNTINGS
    assert Stream.COUNT.value.length >= 100 * (MOST_COUNTINGS - 1) + MOST_COUNT
    firsts = sorted(polish.value.first for polish in polishes)
    assert firsts[-1] + 2 <= Stream.RECOUNT.value.length
    assert min(np.diff(firsts)) >= 2  # a recount takes two


def test_ends_are_chosen_on_paths_that_no_choice_before_has_seen():
    seeds = []

    def halves(tiles, xs, *, seed, samples, jacobian):
        seeds.append(seed)
        # noise that leaves it open which is better, so that all parts are looked at
        noise = np.random.default_rng(seed).normal(size=(len(xs), 30, 1))
        return [(1.0 + part, 1.0 + part) for part in noise]

    pictures = SimpleNamespace(counts=None, tiles=lambda size, most: None, halves=halves, should_stop=lambda: False)
    ends = [np.zeros(1), np.ones(1)]
    for turn in range(MOST_COUNTINGS):
        choose_end(pictures, ends, TransmissionPlan(), 3, Stream.CHOOSE_COUNTED, GUARD_PARTS * turn)
    choose_end(pictures, ends, TransmissionPlan(), 3, Stream.CHOOSE)
    assert len(seeds) >= MOST_COUNTINGS + 1
    assert len(set(seeds)) == len(seeds)
