# SPDX-License-Identifier: Apache-2.0
"""Tiles change what FLIP costs, not what it says. Cost is counted in tiles, which no busy machine changes."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.metrics.flip import flip_reference, hdr_flip
from mfo_backend.metrics.flip.exposure_range import ExposureRange
from mfo_backend.metrics.flip.flip_reference import FlipReference
from mfo_backend.metrics.flip.hdr_flip import HdrFlip
from mfo_backend.metrics.flip.ldr_flip import planes_of

SIZE = (100, 70)


def make_tiles_small(monkeypatch):
    monkeypatch.setattr(flip_reference, "TILE_HEIGHT", 32)
    monkeypatch.setattr(flip_reference, "TILE_WIDTH", 32)


@pytest.fixture
def small_tiles(monkeypatch):
    make_tiles_small(monkeypatch)


@pytest.fixture
def work(monkeypatch):
    """Counts of features computed and of gradients pulled back through them."""
    counts = {"features": 0, "pullback": 0}
    features, pullback = FlipReference._features, flip_reference.FlipDifference.pullback

    def count(name, function):
        def counted(*arguments):
            counts[name] += 1
            return function(*arguments)

        return counted

    monkeypatch.setattr(FlipReference, "_features", count("features", features))
    monkeypatch.setattr(flip_reference.FlipDifference, "pullback", count("pullback", pullback))
    return counts


def images():
    rng = np.random.default_rng(2)
    return rng.random((*SIZE, 3)), rng.random((*SIZE, 3))


def test_tiles_give_the_errors_and_gradients_of_the_whole_picture(monkeypatch):
    """In float64, where only rounding is left between them."""
    reference, test = (planes_of(image) for image in images())
    weight = np.random.default_rng(3).random(SIZE)
    whole = FlipReference(reference, 40.0).compare(test)
    make_tiles_small(monkeypatch)
    tiled = FlipReference(reference, 40.0).compare(test)
    assert len(whole._differences) == 1
    assert len(tiled._differences) == 6
    np.testing.assert_allclose(tiled.error, whole.error, rtol=0, atol=1e-12)
    np.testing.assert_allclose(tiled.pullback(weight), whole.pullback(weight), rtol=1e-9, atol=1e-10)


@pytest.mark.usefixtures("small_tiles")
def test_only_tiles_that_see_a_difference_are_computed(work):
    reference, _ = images()
    test = reference.copy()
    test[5:8, 5:8] = 0  # ten pixels of reach stay inside the first tile's neighbours
    flip = FlipReference(planes_of(reference))
    comparison = flip.compare(planes_of(test))
    assert work["features"] == 2  # the reference's and the test's, of one tile of six
    assert comparison.error[:18, :18].max() > 0
    assert comparison.error[18:].max() == 0
    flip.compare(planes_of(test * 0.9))
    assert work["features"] == 2 + 6 + 5  # the reference's side of the first tile was there already


@pytest.mark.usefixtures("small_tiles")
def test_only_tiles_with_weight_are_pulled_back(work):
    reference, test = images()
    comparison = FlipReference(planes_of(reference)).compare(planes_of(test))
    weight = np.zeros(SIZE)
    weight[40, 10] = 1
    gradient = comparison.pullback(weight)
    assert work["pullback"] == 1
    reached = np.argwhere(np.abs(gradient).max(axis=0) > 0)
    assert (np.abs(reached - [40, 10]).max(axis=0) == 10).all()  # the low-pass of Cz reaches ten pixels


def test_the_references_side_is_computed_once(work):
    reference, test = images()
    flip = HdrFlip(reference, exposures=ExposureRange(-3, 1, 5))
    for scale in (1.0, 0.9, 0.8):
        flip.map(test * scale)
    assert work["features"] == 5 + 3 * 5


def test_large_pictures_are_computed_again_instead_of_kept(monkeypatch, work):
    reference, test = images()
    flip = HdrFlip(reference, exposures=ExposureRange(-3, 1, 5))
    error, gradient = flip.map_and_pullback(test, 1.0)
    kept = work["features"]
    monkeypatch.setattr(hdr_flip, "_KEPT", 0)
    again = flip.map_and_pullback(test, 1.0)
    assert work["features"] == kept + 5 + work["pullback"] // 2
    np.testing.assert_array_equal(again[0], error)
    np.testing.assert_array_equal(again[1], gradient)


def test_exposures_that_cannot_win_or_do_not_win_cost_no_gradient(work):
    """Bright pixels alone: every tone curve is at 1 from two stops above, so those exposures see equal pictures."""
    reference, test = images()
    flip = HdrFlip(reference + 1, exposures=ExposureRange(-3, 12, 6))
    error, gradient = flip.map_and_pullback(test + 1, 1.0)
    assert work["features"] == 2 * 3  # -3, 0 and 3 stops; 2^6 (x + 1) is clipped for all x
    assert work["pullback"] <= 3
    assert error.max() > 0
    assert np.isfinite(gradient).all()
