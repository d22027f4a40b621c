# SPDX-License-Identifier: Apache-2.0
"""How noisy references are compared. Oracles: synthetic pictures of known samples, central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.fit.traced import pictures as traced_tiles
from mfo_backend.fit.traced import sample_count as module
from mfo_backend.fit.traced.sample_count import (
    FURTHEST,
    MOST_COUNT,
    EqualCounts,
    NoiseComparison,
    compressed,
    equal_counts,
    recount,
)
from tests.fit.traced.glass import TRUTH, fit, load
from tests.fit.traced.test_fit import SMALL_LAMP
from tests.render.scenes import FLOOR, SKY

SHAPE = (48, 56)
MASK = np.ones(SHAPE, bool)
MASK[:6], MASK[:, -5:] = False, False
PIXELS = np.flatnonzero(MASK.ravel())
BASE = np.random.default_rng(3).uniform(0.3, 0.9, (1, 1, 3)) * np.linspace(0.5, 1.5, SHAPE[1])[None, :, None]


def fireflies(rng, samples, shape):
    """Means of so many samples of mean 1 with a heavy tail: their variance is infinite."""
    return sum(rng.pareto(1.6, shape) for _ in range(samples)) * (0.6 / samples)


def picture(seed, samples, scale=1.0, noise=fireflies):
    rng = np.random.default_rng(seed)
    # a pixel's channels share most of their noise
    return (scale * BASE * noise(rng, samples, (*SHAPE, 1))).astype(np.float32)


def model(scale=1.0, noise=fireflies):
    def pictures(samples, stream):
        return np.stack(
            [picture([half, samples, stream], samples, scale, noise).reshape(-1, 3)[PIXELS] for half in (1, 2)]
        )

    return pictures


@pytest.mark.parametrize("samples", [1, 4, 10, 23, 50])
def test_the_count_of_a_noisy_reference_is_found(samples):
    found = [equal_counts(picture(s, samples), MASK, PIXELS, None, model()) for s in (100, 101, 102)]
    assert all(found)
    # the curve between two powers of two is taken for a line: 15 %, and noise of 2000 pixels: 10 %
    assert np.mean([np.log(f.count / samples) for f in found]) == pytest.approx(0.0, abs=0.25)


def test_a_smooth_misfit_changes_it_little():
    reference = picture(100, 23)
    right, wrong = (equal_counts(reference, MASK, PIXELS, None, model(scale)).count for scale in (1.0, 1.2))
    assert wrong == pytest.approx(right, rel=0.35)


@pytest.mark.parametrize("samples", [64 * MOST_COUNT, 0], ids=["many", "none"])
def test_a_clean_reference_is_compared_as_it_is(samples):
    clean = (
        picture(100, samples, noise=lambda rng, n, shape: rng.gamma(n, 1.0 / n, shape))
        if samples
        else BASE.astype(np.float32) * np.ones((*SHAPE, 1), np.float32)
    )
    assert equal_counts(clean, MASK, PIXELS, None, model()) is None
    # and so is one whose noise no eye sees
    assert equal_counts(clean, MASK, PIXELS, None, model(noise=lambda rng, n, shape: np.ones(shape))) is None
    assert equal_counts(0.0 * clean, MASK, PIXELS, None, model()) is None


def test_no_bias_is_left_at_equal_counts():
    """The mean compressed difference tells the radiance, whatever the tail; that of unequal counts does not."""
    found = equal_counts(picture(100, 16), MASK, PIXELS, None, model())
    means = {}
    for count in (16, 256):
        images = [compressed(picture([9, k], count)[..., None], found.level, found.top)[MASK] for k in range(8)]
        means[count] = float(np.mean(images) - found.reference[MASK].mean())
    assert abs(means[16]) < 0.03  # three standard errors of 2000 pixels with a deviation of 0.4
    assert means[256] > 0.05


def test_derivatives_are_those_of_compressed_values():
    rng = np.random.default_rng(5)
    value, slope = rng.uniform(0.01, 2.0, (200, 3, 1)), rng.normal(size=(200, 3, 4))
    table = np.concatenate([value, slope], axis=-1)
    got = EqualCounts(np.zeros((1, 1, 3)), np.ones((1, 1, 3)), 0.2, 1.5, 8).compress(table)
    h = 1e-4
    for k in range(4):
        up, down = (compressed(value + sign * h * slope[..., k : k + 1], 0.2, 1.5)[..., 0] for sign in (1, -1))
        away = np.abs(value[..., 0] - 1.5) > 1e-3
        numbers = (up.astype(np.float64) - down) / (2 * h)
        # float32 of values up to 2.1 over 2e-4
        np.testing.assert_allclose(got[..., 1 + k][away], numbers[away], atol=0.003)
        assert np.all(got[..., 1 + k][value[..., 0] > 1.5] == 0.0)


def test_what_a_display_cannot_show_counts_as_its_white():
    reference = np.minimum(picture(100, 16), 1.0)
    clipped = (reference >= 1.0).astype(np.float32)
    found = equal_counts(reference, MASK, PIXELS, clipped, model())
    assert found.top == pytest.approx(1.0)
    assert found.reference.max() == pytest.approx(np.log1p(1.0 / found.level), rel=1e-5)


def test_noise_is_that_around_a_pixel():
    def noisier_to_the_right(rng, samples, shape):
        width = np.linspace(0.2, 0.8, shape[1])[None, :, None]
        return np.exp(rng.normal(size=shape) * width)

    pictures = model(noise=noisier_to_the_right)
    found = equal_counts(picture(100, 1, noise=noisier_to_the_right), MASK, PIXELS, None, pictures)
    assert found is not None
    column = found.noise[8:-2].mean(axis=(0, 2))
    assert np.all(np.diff(column[3:48:6]) > 0.0)
    assert found.noise.min() > 0.1 * found.noise.mean()  # no pixel decides alone
    assert found.mean_noise == pytest.approx(float(found.noise.mean()))


def test_limits_are_in_order():
    assert module.LOUD > 0.0
    assert MOST_COUNT & (MOST_COUNT - 1) == 0  # counts are doubled


SMALL = (40, 50)
SEEN = np.ones(SMALL, bool)
SEEN[:5], SEEN[:, -7:] = False, False
SEEN_PIXELS = np.flatnonzero(SEEN.ravel())


def lognormal(rng, deviation, count=1):
    """Lognormal pixels: after compression far above the level their noise is normal with this deviation."""
    return 100.0 * np.exp(deviation * rng.normal(size=(count, SMALL[0] * SMALL[1], 3)))


def excess_of(seed, model, reference):
    rng = np.random.default_rng(seed)
    comparison = NoiseComparison(lognormal(rng, reference)[0].reshape(*SMALL, 3), SEEN_PIXELS, SMALL, 0.01, np.inf)
    return comparison.excess(lognormal(rng, model, 4)[:, SEEN_PIXELS])


@pytest.mark.parametrize(("model", "reference"), [(0.3, 0.3), (0.3, 0.6), (0.6, 0.3)])
def test_it_is_the_ratio_of_deviations(model, reference):
    found = np.mean([excess_of(seed, model, reference).logarithm for seed in range(8)])
    # own: m sqrt(2); others: sqrt(m^2 + r^2); 4800 values in each of eight: 0.4 %
    expected = np.log(model * np.sqrt(2.0) / np.hypot(model, reference))
    assert found == pytest.approx(expected, abs=0.02)


def test_its_variance_is_that_of_many_references():
    every = [excess_of(seed, 0.5, 0.5) for seed in range(120)]
    scatter = np.std([e.logarithm for e in every])
    stated = np.sqrt(np.mean([e.variance for e in every]))
    assert stated == pytest.approx(scatter, rel=0.25)  # 120 references: 7 %; neighbours across groups are in neither


def test_what_is_too_bright_to_show_is_no_noise():
    rng = np.random.default_rng(0)
    bright = 50.0 + lognormal(rng, 0.5)[0].reshape(*SMALL, 3)
    comparison = NoiseComparison(bright, SEEN_PIXELS, SMALL, 0.01, 10.0)
    assert comparison.excess(50.0 + lognormal(rng, 0.5, 2)[:, SEEN_PIXELS]).logarithm == 0.0


def test_a_picture_without_neighbours_tells_nothing():
    lonely = np.array([0, 3, 7])
    comparison = NoiseComparison(np.ones((*SMALL, 3)), lonely, SMALL, 0.01, np.inf)
    assert comparison.excess(lognormal(np.random.default_rng(0), 0.5, 2)[:, lonely]).logarithm == 0.0


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
    assert (more.log_ratio, fewer.log_ratio) == (FURTHEST, -FURTHEST)
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
        found = [fit(renderer, renderer.image(x, seed=seed, spp=8))[0].recovered for seed in (5, 6)]
        errors[again] = np.mean([np.abs(renderer.table.pack(values) - x)[:3] for values in found])
    assert errors[True] < 0.6 * errors[False]  # 0.017 and 0.040


def test_values_are_as_unsure_as_the_count(glass, monkeypatch):
    renderer, x = glass
    known, sizes = traced_tiles.recount, {}
    for sd in (0.0, 1.0):
        unsure = lambda *of, sd=sd: replace(known(*of), log_ratio=0.0, sd=sd)  # noqa: E731
        monkeypatch.setattr(traced_tiles, "recount", unsure)
        sizes[sd] = fit(renderer, renderer.image(x, seed=5, spp=8))[0].certainty["base_color"].sd
    # 1.48 to 1.62 times, as the two fits end apart; 1 where the count's own doubt is left out
    assert np.all(np.array(sizes[1.0]) > 1.3 * np.array(sizes[0.0]))
