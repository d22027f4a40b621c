# SPDX-License-Identifier: Apache-2.0
"""FLIP of random picture pairs against exact arithmetic and the package; MFO_FLIP_PAIRS=1000 asks for more of them.

The maps for reports are computed in float64 and equal the papers' formulas to 1e-6 on every pair. The authors' package
and our losses compute in float32, which FLIP's powers magnify to some 1e-4 where two pictures nearly agree or are flat:
there, and only there, 1e-5 between a package's pixel and ours cannot hold, and what rounding explains is allowed.
"""

from __future__ import annotations

import os

import flip_evaluator as oracle
import numpy as np
import pytest

from mfo_backend.metrics.display.colour import linear_from_srgb
from mfo_backend.metrics.flip.flip_reference import FlipReference
from mfo_backend.metrics.flip.hdr_flip import HdrFlip, hdr_flip_map
from mfo_backend.metrics.flip.ldr_flip import flip_map, planes_of
from tests.metrics.flip.exact_flip import exact_flip, exact_hdr_flip

PAIRS = int(os.environ.get("MFO_FLIP_PAIRS", "48"))

EXACT = 1e-6  # rounding of the map to float32 and, magnified, that of float64
EXACT_HDR_EVERY = 8  # the two-dimensional filters of many exposures take seconds

# Rounding of float32 where FLIP's powers magnify it: a dozen units in the last place of a Lab value near 100 and one of
# a luminance near 1. Where two pictures nearly agree, float32 moves by what this makes of the exact value.
LAB_ROUNDING = 1e-4
FEATURE_ROUNDING = 1e-7


def noise(rng, y, x):
    return rng.random((*y.shape, 3))


def edges(rng, y, x):
    side = (np.cos(angle := rng.uniform(0, 7)) * x + np.sin(angle) * y) % rng.integers(4, 30) < rng.integers(2, 12)
    return np.where(side[..., None], rng.random(3), rng.random(3))


def constant(rng, y, x):
    return np.broadcast_to(rng.random(3), (*y.shape, 3))


def waves(rng, y, x):
    return 0.5 + 0.5 * np.sin(rng.uniform(0, 1.5, 3) * x[..., None] + rng.uniform(0, 1.5, 3) * y[..., None])


def object_on_black(rng, y, x):
    inside = (x - x.mean()) ** 2 + (y - y.mean()) ** 2 < (0.3 * min(x.shape)) ** 2
    return np.where(inside[..., None], waves(rng, y, x), 0)


KINDS = (noise, edges, constant, waves, object_on_black)


def pair(seed):
    """Two pictures in [0, 1]: unrelated, or the second a changed copy of the first."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: rng.integers(8, 48), : rng.integers(8, 48)]
    reference = KINDS[seed % len(KINDS)](rng, y, x)
    change = (seed // len(KINDS)) % 4
    if change == 0:
        test = KINDS[rng.integers(len(KINDS))](rng, y, x)
    elif change == 1:
        test = reference * rng.uniform(0.5, 1.3)
    elif change == 2:
        test = reference + 0.05 * rng.standard_normal(reference.shape)
    else:
        test = np.where(rng.random((*y.shape, 1)) < 0.02, rng.random(3), reference)
    return reference.astype(np.float32), np.clip(test, 0, 1).astype(np.float32)


def rounding(flip, light):
    """How far rounding can move a pixel: the exact error with its differences changed by the rounding of float32."""
    slack = np.zeros(light.shape[:2])
    for _, difference in flip.compare(planes_of(light.astype(np.float64)))._differences:
        for hyab in (difference._hyab, np.maximum(difference._hyab - LAB_ROUNDING, 0), difference._hyab + LAB_ROUNDING):
            colour_error = difference._colour_error * (hyab / np.maximum(difference._hyab, 1e-12)) ** 0.7
            for feature in (
                difference._feature,
                np.maximum(difference._feature - FEATURE_ROUNDING, 0),
                difference._feature + FEATURE_ROUNDING,
            ):
                moved = np.minimum(colour_error, 1) ** (1 - np.sqrt(np.minimum(feature, 1)))
                slack = np.maximum(slack, np.abs(moved - difference.error))
    return slack


def assert_equal_maps(ours, theirs, slack):
    assert (np.abs(ours - theirs) - slack).max() <= 1e-5
    # over flat pictures rounding is the same in every pixel and does not average out
    assert abs(ours.mean(dtype=np.float64) - theirs.mean(dtype=np.float64)) <= 2e-6 + slack.mean()


@pytest.mark.parametrize("seed", range(PAIRS))
def test_ldr_pair(seed):
    reference, test = pair(seed)
    ours = flip_map(reference, test)
    np.testing.assert_allclose(ours, exact_flip(reference, test), rtol=0, atol=EXACT)
    exact = [linear_from_srgb(image.astype(np.float64)) for image in (reference, test)]
    slack = rounding(FlipReference(planes_of(exact[0])), exact[1])
    assert_equal_maps(ours, oracle.evaluate(reference, test, "LDR", applyMagma=False)[0][..., 0], slack)
    light = [planes_of(linear_from_srgb(image)) for image in (reference, test)]
    assert_equal_maps(ours, FlipReference(light[0]).compare(light[1]).error, slack)


@pytest.mark.parametrize("seed", range(PAIRS))
def test_hdr_pair(seed):
    reference, test = ((0.01 * 10 ** (3 * image) * (image > 0)).astype(np.float32) for image in pair(seed))
    spikes = np.random.default_rng(seed).random(test.shape[:2]) < 0.005
    test[spikes] *= 1000
    ours = hdr_flip_map(reference, test)
    if seed % EXACT_HDR_EVERY == 0:
        np.testing.assert_allclose(ours, exact_hdr_flip(reference, test), rtol=0, atol=EXACT)
    exact = HdrFlip(reference.astype(np.float64))
    slack = np.max([rounding(flip, test.astype(np.float64)) for flip in exact._references], axis=0)
    assert_equal_maps(ours, oracle.evaluate(reference, test, "HDR", applyMagma=False)[0][..., 0], slack)
    error, gradient = HdrFlip(reference).map_and_pullback(test, 1 / ours.size)
    assert_equal_maps(ours, error, slack)
    assert np.isfinite(gradient).all()
