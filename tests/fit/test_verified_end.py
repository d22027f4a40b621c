# SPDX-License-Identifier: Apache-2.0
"""Pictures of a fit's ends: as many samples as they need, the same random numbers for all, none twice."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.verified_end import (
    FIRST_SAMPLES,
    FIRST_SAMPLES_EXACT,
    MOST_EVEN,
    PATHS_OF_A_PART,
    START_SAMPLES,
    Verification,
)
from mfo_backend.metrics.tone_mapping import DisplayView
from mfo_backend.types.image import Encoding, Image

SHAPE = (32, 32, 3)
NOISE = 0.2  # standard deviation of one sample of a pixel
MOST = 64
FAR = 2 * MOST_EVEN  # samples of a start that is far away: a part of each half


class Renderer:
    """Grey pictures of the vector's first value with the noise of their samples, as independent as their seeds."""

    def __init__(self, noise: float = NOISE, shape=SHAPE) -> None:
        self.passes, self.taken, self._noise, self._shape = 0.0, [], noise, shape

    def image_later(self, vector, *, seed, spp, even):
        assert even
        self.taken.append((float(vector[0]), seed, spp))
        self.passes += 1.0
        noise = np.random.default_rng(seed).normal(size=self._shape) * self._noise / np.sqrt(spp)
        return lambda: (vector[0] + noise).astype(np.float32)


def verification(renderer, reference, most=MOST, shape=SHAPE, **more):
    image = Image(np.broadcast_to(np.float32(reference), shape).astype(np.float32), Encoding.LINEAR)
    mask = np.ones(shape[:2], bool)
    return Verification(renderer, image, mask, DisplayView(), seed=7, most=most, **more)


def samples_of(renderer, value):
    return sum(spp for shown, _, spp in renderer.taken if shown == value)


def found(renderer, reference, start, ends, **more):
    check = verification(renderer, reference, **more)
    return check.pictures(check.begin(np.array([start])), [np.array([end]) for end in ends])


def test_only_what_is_near_the_reference_takes_all_samples():
    renderer = Renderer()
    found(renderer, 0.4, 0.8, [0.4])
    assert samples_of(renderer, 0.8) == FAR
    assert samples_of(renderer, 0.4) == MOST
    assert renderer.passes == pytest.approx(1 + FAR / MOST)  # a whole picture is one


def test_fewer_samples_to_begin_with_grow_as_much():
    renderer = Renderer()
    found(renderer, 0.4, 0.8, [0.7, 0.4], first=FIRST_SAMPLES_EXACT)
    assert samples_of(renderer, 0.7) == samples_of(renderer, 0.4) == MOST
    renderer = Renderer()
    found(renderer, 0.4, 0.8, [0.7], first=FIRST_SAMPLES_EXACT)
    assert samples_of(renderer, 0.7) == FIRST_SAMPLES_EXACT


def test_a_start_at_the_solution_takes_all_samples_too():
    renderer = Renderer()
    start, end = found(renderer, 0.4, 0.4, [0.4001])
    assert samples_of(renderer, 0.4) == samples_of(renderer, 0.4001) == MOST
    np.testing.assert_allclose(end.image - start.image, 0.0001, atol=1e-6)  # under the same random numbers


@pytest.mark.parametrize(("reference_samples", "expected"), [(2, FIRST_SAMPLES), (4, FIRST_SAMPLES), (64, MOST)])
def test_a_noisy_reference_needs_fewer_samples(reference_samples, expected):
    renderer = Renderer()
    noisy = 0.4 + np.random.default_rng(99).normal(size=SHAPE) * NOISE / np.sqrt(reference_samples)
    found(renderer, noisy, 0.9, [0.4])
    assert samples_of(renderer, 0.4) == expected


def test_the_ends_of_the_fit_take_equally_many():
    renderer = Renderer()
    found(renderer, 0.4, 0.9, [0.4, 0.7])
    assert samples_of(renderer, 0.4) == samples_of(renderer, 0.7) == MOST


def test_noise_that_is_not_seen_takes_no_samples():
    renderer = Renderer(noise=0.002)
    found(renderer, 0.4, 0.9, [0.4])
    assert samples_of(renderer, 0.4) == FIRST_SAMPLES


def test_samples_are_independent_and_weighted_alike():
    renderer = Renderer()
    end = found(renderer, 0.4, 0.9, [0.4])[1]
    seeds = [seed for value, seed, _ in renderer.taken if value == 0.4]
    assert len(set(seeds)) == len(seeds)
    np.testing.assert_allclose(end.image, 0.5 * (end.halves[0] + end.halves[1]), atol=1e-6)
    # 3072 values: the standard deviation of their standard deviation is 1.3 %
    for picture, count in ((end.image, MOST), (end.halves[0], MOST // 2), (end.halves[1], MOST // 2)):
        assert (picture - 0.4).std() == pytest.approx(NOISE / np.sqrt(count), rel=0.05)
    assert abs(np.corrcoef(*(half.ravel() for half in end.halves))[0, 1]) < 0.06  # three standard errors


@pytest.mark.parametrize("most", [1, 2, 5, 16, 50])
def test_no_more_samples_than_asked_for(most):
    renderer = Renderer()
    found(renderer, 0.4, 0.9, [0.4], most=most)
    assert samples_of(renderer, 0.4) == 2 * max(most // 2, 1)


def test_a_request_to_stop_ends_it():
    renderer = Renderer()
    start, end = found(renderer, 0.4, 0.4, [0.4001], should_stop=lambda: True)
    assert samples_of(renderer, 0.4) == samples_of(renderer, 0.4001) == FAR
    assert start.image.shape == end.image.shape == SHAPE


def test_large_pictures_come_in_parts_that_a_stop_is_heard_between():
    side = 1 << 9
    shape = (side, side, 3)
    renderer = Renderer(shape=shape)
    found(renderer, 0.4, 0.9, [], shape=shape)
    assert max(side * side * spp for _, _, spp in renderer.taken) <= PATHS_OF_A_PART
    assert samples_of(renderer, 0.9) == START_SAMPLES
    renderer = Renderer(shape=shape)
    found(renderer, 0.4, 0.9, [0.4], shape=shape, should_stop=lambda: len(renderer.taken) > 6)
    assert len(renderer.taken) == 8  # a part of each half of the start and three of the end
