# SPDX-License-Identifier: Apache-2.0
"""The samples of a reference counted again. Oracles: pictures of known counts, means of many pictures, a whole fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.fit.traced import pictures as traced_tiles
from mfo_backend.fit.traced.noise_excess import NoiseComparison
from mfo_backend.fit.traced.recount import MOST, recount
from mfo_backend.fit.traced.sample_count import compressed, equal_counts
from tests.fit.traced.glass import TRUTH, fit, load
from tests.fit.traced.test_fit import SMALL_LAMP
from tests.fit.traced.test_sample_count import MASK, PIXELS, SHAPE, model, picture
from tests.render.scenes import FLOOR, SKY


def recounted(reference, count):
    counts = replace(equal_counts(reference, MASK, PIXELS, None, model()), count=count)
    comparison = NoiseComparison(reference, PIXELS, SHAPE, counts.level, counts.top)
    return counts, recount(counts, comparison, model())


@pytest.mark.parametrize(("samples", "count"), [(4, 4), (4, 3), (5, 4), (20, 24), (24, 20), (10, 14)])
def test_the_count_is_found_between_whole_numbers(samples, count):
    found = [recounted(picture(seed, samples), count)[1] for seed in range(100, 112)]
    away = np.array([(f.log_ratio - np.log(samples / count)) / f.sd for f in found])
    assert abs(np.mean([f.log_ratio for f in found]) - np.log(samples / count)) < 0.1
    assert np.sqrt(np.mean(away**2)) < 1.6  # twelve of chi-square with one degree of freedom: 99 % below 1.48


def test_a_count_that_is_far_off_is_no_straight_line_away():
    more, fewer = (recounted(picture(100, samples), count)[1] for samples, count in ((40, 4), (2, 20)))
    assert (more.log_ratio, fewer.log_ratio) == (MOST, -MOST)
    for found in (more, fewer):  # a factor of ten, of which two is followed: the rest is not sure
        assert found.sd > np.log(2.0)


def test_the_slope_is_that_of_compressed_means():
    counts, found = recounted(picture(100, 8), 8)
    means = [
        np.mean([compressed(picture([9, n, k], n)[..., None], counts.level, counts.top)[MASK] for k in range(16)])
        for n in (8, 16)
    ]
    # four pictures of 2000 pixels and sixteen, deviation 0.4, shared by channels: 0.007
    assert found.slope.mean() * np.log(2.0) == pytest.approx(means[1] - means[0], abs=0.02)


@pytest.fixture
def glass(tmp_path):
    renderer = load(tmp_path, size=48, lights=SKY + FLOOR + SMALL_LAMP)
    return renderer, renderer.table.pack(TRUTH)


def test_a_wrong_count_is_made_good(glass, monkeypatch):
    renderer, x = glass
    counted, known = traced_tiles.equal_counts, traced_tiles.recount
    # a quarter of the samples that the reference has, of which half are made good
    monkeypatch.setattr(traced_tiles, "equal_counts", lambda *of: replace(counted(*of), count=2))
    errors = {}
    for again in (True, False):
        monkeypatch.setattr(traced_tiles, "recount", known if again else lambda *of: replace(known(*of), log_ratio=0.0))
        found = [fit(renderer, renderer.image(x, seed=seed, spp=8))[0].recovered for seed in (5, 6, 7)]
        errors[again] = np.mean([np.abs(renderer.table.pack(values) - x)[:3] for values in found])
    assert errors[True] < 0.6 * errors[False]  # 0.017 and 0.040


def test_values_are_as_unsure_as_the_count(glass, monkeypatch):
    renderer, x = glass
    known, sizes = traced_tiles.recount, {}
    for sd in (0.0, 1.0):
        unsure = lambda *of, sd=sd: replace(known(*of), log_ratio=0.0, sd=sd)  # noqa: E731
        monkeypatch.setattr(traced_tiles, "recount", unsure)
        sizes[sd] = fit(renderer, renderer.image(x, seed=5, spp=8))[0].certainty["base_color"].sd
    assert np.all(np.array(sizes[1.0]) > 1.5 * np.array(sizes[0.0]))
