# SPDX-License-Identifier: Apache-2.0
"""Wrappers hand on pictures and passes and change what they are for."""

from __future__ import annotations

import numpy as np

from mfo_backend.bench.runs.wrapped_renderer import NewSeeds, Watched
from mfo_backend.render.pictures.pass_counter import PassCounter


class Counting:
    model, table, start = "model", None, np.zeros(2)

    def __init__(self):
        self.counter = PassCounter()
        self.seeds = []

    @property
    def passes(self):
        return self.counter.count

    def image(self, vector, *, seed, spp):
        self.seeds.append(seed)
        self.counter.add(1.0)
        return np.full((2, 2, 3), vector.sum())

    def image_and_pullback(self, vector, *, seed, spp):
        def pullback(gradient):
            self.counter.add(2.0)
            return np.full(2, gradient.sum())

        return self.image(vector, seed=seed, spp=spp), pullback

    def target_mask(self):
        return np.ones((2, 2), bool)


def test_new_seeds_are_new_each_time_and_the_same_again():
    inner, again = Counting(), Counting()
    for renderer in (inner, again):
        around = NewSeeds(renderer, 3)
        for _ in range(4):
            around.image(np.ones(2), seed=7, spp=1)
            around.image_and_pullback(np.ones(2), seed=7, spp=1)
    assert len(set(inner.seeds)) == 8
    assert inner.seeds == again.seeds


def test_the_watched_renderer_notes_steps_and_counts_passes():
    around = Watched(Counting())
    around.image(np.zeros(2), seed=1, spp=1)
    image, pullback = around.image_and_pullback(np.ones(2), seed=1, spp=1)
    assert around.passes == 2.0
    np.testing.assert_array_equal(pullback(image), [24.0, 24.0])
    assert around.passes == 4.0
    np.testing.assert_array_equal(around.visited, [[1.0, 1.0]])
