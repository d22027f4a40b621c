# SPDX-License-Identifier: Apache-2.0
"""How noisy references are compared. Oracles: synthetic pictures of known samples, central differences."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.traced import sample_count as module
from mfo_backend.fit.traced.sample_count import MOST_COUNT, EqualCounts, compressed, equal_counts

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
