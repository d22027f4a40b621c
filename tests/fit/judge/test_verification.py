# SPDX-License-Identifier: Apache-2.0
"""Pictures of a fit's ends: as many samples as they need, the same random numbers for all, none twice."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.judge.verification import (
    BLURRED,
    FIRST_SAMPLES,
    FIRST_SAMPLES_EXACT,
    MOST_EVEN,
    MOST_FURTHER,
    MOST_WHOLE,
    PATHS_OF_A_PART,
    SHOWN_SAMPLES,
    Verification,
)
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.display.colour import srgb_from_linear
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.render.camera.widened_mask import widened
from mfo_backend.render.pictures.pass_counter import PassCounter
from mfo_backend.types.image import Encoding, Image

SHAPE = (32, 32, 3)
NOISE = 0.2  # standard deviation of one sample of a pixel
MOST = 64
FAR = 2 * MOST_EVEN  # samples of a start that is far away: a part of each half


class Renderer:
    """Grey pictures of the vector's first value with noise that seeds and places in a launch decide."""

    def __init__(self, noise: float = NOISE, shape=SHAPE) -> None:
        self.counter, self.taken, self._noise, self._shape = PassCounter(), [], noise, shape

    @property
    def passes(self):
        return self.counter.count

    def pixels_later(self, vector, pixels, *, seed, spp):
        assert spp == 1 or len(pixels) * spp <= 2 * MOST_WHOLE
        self.taken.append((float(vector[0]), seed, spp, len(pixels)))
        self.counter.add(1.0)
        noise = np.random.default_rng(seed).normal(size=(len(pixels), 3)) * self._noise / np.sqrt(spp)
        return lambda: (vector[0] + noise).astype(np.float32)


def verification(renderer, reference, most=MOST, shape=SHAPE, mask=None, should_stop=lambda: False, **more):
    image = Image(np.broadcast_to(np.float32(reference), shape).astype(np.float32), Encoding.LINEAR)
    mask = np.ones(shape[:2], bool) if mask is None else mask
    task = SimpleNamespace(
        reference=image, counted=mask, view=DisplayView(), settings=FitSettings(seed=7, verify_spp=most),
        should_stop=should_stop,
    )  # fmt: skip
    return Verification(renderer, task, **more)


def samples_of(renderer, value):
    """Samples a pixel that is looked at: a launch holds both halves of a picture."""
    return sum(2 * spp for shown, _, spp, _ in renderer.taken if shown == value)


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
    seeds = [seed for value, seed, *_ in renderer.taken if value == 0.4]
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


@pytest.mark.parametrize(("side", "block"), [(32, 1), (600, 3)])
def test_a_glance_has_a_start_of_one_pixel_of_every_block(side, block):
    renderer, mask = Renderer(), np.zeros((side, side), bool)
    mask[6:18, 6:18] = True
    check = verification(renderer, 0.4, shape=(side, side, 3), mask=mask)
    picture = check.glance(np.array([0.8]), elsewhere=np.full((side, side, 3), 0.1, np.float32))
    looked_at = widened(mask, BLURRED)
    (_, _, spp, count), *others = renderer.taken
    assert others == []
    check.begin(np.array([0.8]))
    assert spp == renderer.taken[-1][2]  # by a kernel that there is anyway
    assert np.all(picture[~looked_at] == np.float32(0.1))
    np.testing.assert_allclose(picture[looked_at], 0.8, atol=5 * NOISE / np.sqrt(spp))
    rows = np.unique(np.nonzero(looked_at)[0] // block)
    assert len(rows) ** 2 - 4 * BLURRED**2 <= count <= len(rows) ** 2  # its corners are round
    inside = picture[6:18, 6:18].reshape(12 // block, block, 12 // block, block, 3)
    assert np.all(inside == inside[:, :1, :, :1])


def test_a_request_to_stop_ends_it():
    renderer = Renderer()
    start, end = found(renderer, 0.4, 0.4, [0.4001], should_stop=lambda: True)
    assert samples_of(renderer, 0.4) == samples_of(renderer, 0.4001) == FAR
    assert start.image.shape == end.image.shape == SHAPE


def test_large_pictures_come_in_parts_that_a_stop_is_heard_between():
    side = 1 << 9
    shape = (side, side, 3)
    renderer = Renderer(shape=shape)
    found(renderer, 0.4, 0.9, [0.4], shape=shape)
    parts = [count * spp for value, _, spp, count in renderer.taken if value == 0.4]
    assert parts[0] <= MOST_WHOLE
    assert max(parts[1:]) <= 2 * PATHS_OF_A_PART
    assert samples_of(renderer, 0.9) == FAR
    renderer = Renderer(shape=shape)
    found(renderer, 0.4, 0.9, [0.4], shape=shape, should_stop=lambda: len(renderer.taken) > 3)
    assert len(renderer.taken) == 4  # a part of the start and three of the end


def test_only_what_is_looked_at_and_a_few_pixels_around_it_takes_further_samples():
    mask = np.zeros(SHAPE[:2], bool)
    mask[10:20, 4:12] = True
    renderer = Renderer()
    start, end = found(renderer, 0.4, 0.9, [0.4], mask=mask)
    counts = [count for value, _, _, count in renderer.taken if value == 0.4]
    assert counts[0] == 2 * 32 * 32
    assert set(counts[1:]) == {2 * (10 + 2 * BLURRED) * (4 + 8 + BLURRED)}  # the picture ends at its left edge
    further = MOST - FAR
    assert renderer.passes == pytest.approx((2 * FAR + further * counts[1] / (2 * 32**2)) / MOST)
    noise = [np.square(end.image[where] - 0.4).mean() ** 0.5 for where in (mask, ~widened(mask, BLURRED))]
    # 240 and 2300 values
    assert noise[0] == pytest.approx(NOISE / np.sqrt(MOST), rel=0.15)
    assert noise[1] == pytest.approx(NOISE / np.sqrt(FAR), rel=0.06)
    assert end.image.shape == start.image.shape == SHAPE


@pytest.mark.parametrize(
    ("size", "share", "whole", "most"),
    [
        ((256, 256), 1.0, 8, 64),  # as if there were no limits
        ((1080, 1920), 0.13, 2, 16),
        ((1080, 1920), 1.0, 2, 4),
        ((2160, 3840), 0.01, 2, 32),
    ],
)
def test_huge_pictures_have_a_limit_for_all_their_samples(size, share, whole, most):
    mask = np.zeros(size, bool)
    mask[: int(size[0] * share)] = True
    check = verification(Renderer(), 0.4, shape=(*size, 3), mask=mask)
    assert 2 * check._begun == whole
    assert 2 * check._most_here == most
    paths = 2 * (mask.size * check._begun + len(check._looked_at) * (check._most_here - check._begun))
    assert paths <= max(MOST_WHOLE, 2 * mask.size) + MOST_FURTHER


@pytest.mark.parametrize(("noise", "samples"), [(NOISE / 2, 2), (2 * NOISE, 4)])
def test_pixels_that_are_compared_as_blocks_need_fewer_samples(noise, samples):
    """Blocks of 4 x 4 pixels have 32 samples when their pixels have 2; where they say too little there are more."""
    size = (1200, 1600)
    renderer = Renderer(noise, (*size, 3))
    start, end = found(renderer, 0.4, 1.9, [0.5], shape=(*size, 3))
    assert 2 * start.samples == SHOWN_SAMPLES
    assert 2 * end.samples == samples == samples_of(renderer, 0.5)


def halves_of(picture, where):
    return [half[where] for half in picture.halves]


def test_ends_see_the_random_numbers_of_a_start_that_is_whole():
    mask = np.zeros(SHAPE[:2], bool)
    mask[10:20, 4:12] = True
    for ends in ([0.5], [0.5, 0.6]):
        pictures = found(Renderer(), 0.4, 0.9, ends, mask=mask, most=FAR)
        first, *others = (np.array(halves_of(picture, mask)) - picture.vector[0] for picture in pictures)
        for noise in others:
            np.testing.assert_allclose(noise, first, atol=1e-6)


@pytest.mark.parametrize("region", ["box", "all"])
def test_one_of_several_ends_is_finished_with_surroundings_of_its_own(region):
    mask = np.zeros(SHAPE[:2], bool)
    mask[10:20, 4:12] = True
    mask |= region == "all"
    around = ~widened(mask, BLURRED)
    renderer = Renderer()
    check = verification(renderer, 0.4, mask=mask)
    start, one, other = check.pictures(check.begin(np.array([0.9])), [np.array([0.5]), np.array([0.6])])
    for end in (one, other):  # nobody has looked there yet
        np.testing.assert_array_equal(halves_of(end, around), halves_of(start, around))
    taken = len(renderer.taken)
    finished = check.finished(one)
    further = [launch[:1] + launch[2:] for launch in renderer.taken[taken:]]
    assert further == [(0.5, MOST_EVEN, 2 * np.count_nonzero(around))][: around.sum()]
    seeds = [seed for value, seed, *_ in renderer.taken if value == 0.5]
    assert len(set(seeds)) == len(seeds)
    np.testing.assert_array_equal(halves_of(finished, ~around), halves_of(one, ~around))
    np.testing.assert_allclose(finished.image, 0.5, atol=5 * NOISE / np.sqrt(FAR))
    np.testing.assert_array_equal(one.image[around], start.image[around])  # as it was
    assert check.finished(finished) is finished
    assert check.finished(start) is start


@pytest.mark.parametrize(("size", "shown"), [((1200, 1600), SHOWN_SAMPLES), ((1500, 2000), 2)])
def test_what_is_shown_has_some_more_samples_within_the_limit(size, shown):
    renderer = Renderer(0.001, (*size, 3))
    check = verification(renderer, 0.4, shape=(*size, 3))
    _, end = check.pictures(check.begin(np.array([0.9])), [np.array([0.5])])
    assert 2 * end.samples == 2
    assert 2 * check.finished(end).samples == shown == samples_of(renderer, 0.5)


def test_no_piece_of_a_whole_frame_repeats_the_numbers_of_further_samples():
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    from mfo_backend.render.pictures.pixel_pictures import pieces_of

    mask = np.zeros((1500, 2000), bool)
    mask[:100, :100] = True
    renderer = Renderer()
    found(renderer, 0.4, 0.9, [0.4], shape=(*mask.shape, 3), mask=mask)
    taken = [(seed, spp, count) for value, seed, spp, count in renderer.taken if value == 0.4]
    seeds = [piece.seed for seed, spp, count in taken for piece in pieces_of(np.arange(count), seed, spp)]
    assert len(seeds) > len(taken)  # there are pieces
    assert len(set(seeds)) == len(seeds)


def test_a_further_picture_is_compared_under_the_same_numbers():
    """Of 0.4 the pictures of 0.4 and 0.42: farther by the square of their difference, of which noise has no part."""
    renderer = Renderer()
    check = verification(renderer, 0.4)
    end = check.pictures(check.begin(np.array([0.8])), [np.array([0.4])])[1]
    same = check.like(end, np.array([0.4]))
    assert all(np.array_equal(a, b) for a, b in zip(end.halves, same.halves, strict=True))
    assert check.farther(end, same) == (0.0, 0.0)
    other = check.like(end, np.array([0.5]))
    assert other.samples == end.samples
    more, error = check.farther(end, other)
    wanted = np.square(srgb_from_linear(np.float32(0.5)) - srgb_from_linear(np.float32(0.4)))
    assert error < 0.2 * wanted
    assert more == pytest.approx(wanted, abs=3.0 * error)
