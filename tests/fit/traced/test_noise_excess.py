# SPDX-License-Identifier: Apache-2.0
"""How much noisier pictures are than a reference. Oracle: pictures of known noise, made many times."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.traced.noise_excess import NoiseComparison

SHAPE = (40, 50)
MASK = np.ones(SHAPE, bool)
MASK[:5], MASK[:, -7:] = False, False
PIXELS = np.flatnonzero(MASK.ravel())


def picture(rng, deviation, count=1):
    """Lognormal pixels: after compression far above the level their noise is normal with this deviation."""
    return 100.0 * np.exp(deviation * rng.normal(size=(count, SHAPE[0] * SHAPE[1], 3)))


def excess_of(seed, model, reference):
    rng = np.random.default_rng(seed)
    comparison = NoiseComparison(picture(rng, reference)[0].reshape(*SHAPE, 3), PIXELS, SHAPE, 0.01, np.inf)
    return comparison.excess(picture(rng, model, 4)[:, PIXELS])


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
    bright = 50.0 + picture(rng, 0.5)[0].reshape(*SHAPE, 3)
    comparison = NoiseComparison(bright, PIXELS, SHAPE, 0.01, 10.0)
    assert comparison.excess(50.0 + picture(rng, 0.5, 2)[:, PIXELS]).logarithm == 0.0


def test_a_picture_without_neighbours_tells_nothing():
    lonely = np.array([0, 3, 7])
    comparison = NoiseComparison(np.ones((*SHAPE, 3)), lonely, SHAPE, 0.01, np.inf)
    assert comparison.excess(picture(np.random.default_rng(0), 0.5, 2)[:, lonely]).logarithm == 0.0
