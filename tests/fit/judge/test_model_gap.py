# SPDX-License-Identifier: Apache-2.0
"""The figure for what a fit could not explain, on pictures whose true difference is known."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.judge.model_gap import model_gap
from mfo_backend.fit.tolerances import DIM_FLOOR
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.model_gap import ModelGap

SIZE = 96
VIEW = DisplayView()


def pictures(difference=0.0, noise=0.0, seed=0):
    """Reference and two renders, noise of each its own; `difference` is relative, its sign that of wide stripes."""
    draw = np.random.default_rng(seed)
    level = np.broadcast_to(np.linspace(0.05, 0.8, SIZE)[:, None, None], (SIZE, SIZE, 3))
    sign = np.where((np.arange(SIZE) // 16) % 2, 1, -1)[None, :, None]
    wrong = level * (1 + difference * sign)
    shots = [p * (1 + noise * draw.standard_normal(p.shape)) for p in (level, wrong, wrong)]
    reference, *renders = (p.astype(np.float32) for p in shots)
    return reference, tuple(renders)


def gap_of(reference, renders, mask=None):
    mask = np.ones((SIZE, SIZE), bool) if mask is None else mask
    return model_gap(Image(reference, Encoding.LINEAR), renders, mask, VIEW)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.15])
def test_a_known_difference_is_found_through_noise(noise):
    """The level is raised by DIM_FLOOR of its mean, so dark blocks count less."""
    reference, renders = pictures(0.03, noise)
    level = np.linspace(0.05, 0.8, SIZE).reshape(-1, 4).mean(axis=1)
    expected = 0.03 * np.sqrt(np.mean((level / (level + DIM_FLOOR * level.mean())) ** 2))
    found = gap_of(reference, renders)
    assert found.relative == pytest.approx(expected, rel=0.01 + noise / 2)
    assert found.at_most >= found.relative


def test_noise_alone_is_no_gap():
    """One picture in forty may exceed its bounds by chance; ten of forty would not."""
    found = [gap_of(*pictures(0.0, 0.2, seed)) for seed in range(40)]
    assert sum(gap.relative > 0 for gap in found) <= 4
    # (0.2^2 / 4)^0.5 for half a block, 3 x 576 of them: 0.02 and a few standard deviations of its square
    assert max(gap.at_most for gap in found) < 0.04


@pytest.mark.parametrize("shape", [0.05, 0.2])
def test_few_samples_with_fireflies_are_no_gap(shape):
    """Gamma noise, whose relative variance is 1 / shape. One picture in forty may exceed its bounds by chance."""

    def gap(seed):
        draw = np.random.default_rng(seed)
        reference, renders = pictures()
        noisy = tuple((r * draw.gamma(shape, 1 / shape, r.shape)).astype(np.float32) for r in renders)
        return gap_of(reference, noisy)

    assert sum(gap(seed).relative > 0 for seed in range(20)) <= 3


def test_only_the_target_counts():
    reference, renders = pictures()
    mask = np.zeros((SIZE, SIZE), bool)
    mask[:48] = True
    wrong = tuple(np.where(mask[..., None], r, 2 * r) for r in renders)
    assert gap_of(reference, wrong, mask) == ModelGap(0.0, 0.0)
    assert gap_of(reference, wrong).relative > 0.3


def test_a_small_target_has_no_figure():
    mask = np.zeros((SIZE, SIZE), bool)
    mask[:8, :8] = True
    assert gap_of(*pictures(0.5), mask) is None


def test_a_display_reference_is_compared_as_a_display_shows_it():
    """What is above white in both is equal there."""
    reference, renders = pictures(0.1)
    shown = VIEW.display(reference * 2)
    found = model_gap(Image(shown, Encoding.SRGB), tuple(r * 2 for r in renders), np.ones((SIZE, SIZE), bool), VIEW)
    bright = model_gap(
        Image(VIEW.display(reference * 90), Encoding.SRGB),
        tuple(r * 90 for r in renders),
        np.ones((SIZE, SIZE), bool),
        VIEW,
    )
    assert 0.03 < found.relative < 0.1
    assert bright == ModelGap(0.0, 0.0)


def test_a_sentence_only_where_something_could_be_seen():
    assert ModelGap(0.004, 0.006).sentence == ""
    assert ModelGap(0.0234, 0.03).sentence.startswith("Model gap 2.3 %: ")
