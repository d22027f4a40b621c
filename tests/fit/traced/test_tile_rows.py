# SPDX-License-Identifier: Apache-2.0
"""Tiles of pixels as rows of a least-squares problem."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.traced.tile_rows import TileRows


@pytest.fixture
def picture():
    return np.random.default_rng(0).uniform(0.2, 1.0, (20, 24, 3)).astype(np.float32)


def test_a_residual_is_the_weighted_difference_of_tile_means(picture):
    mask = np.ones((20, 24), bool)
    tiles = TileRows.of(picture, mask, 4)
    assert len(tiles) == 30
    image = 1.5 * picture.reshape(-1, 3)[tiles.pixels]
    rows = tiles.rows(np.stack([image, image], axis=-1)).reshape(30, 3, 2)
    means = picture.reshape(5, 4, 6, 4, 3).mean(axis=(1, 3)).reshape(30, 3)
    np.testing.assert_allclose(rows[..., 0], 0.5 * means * tiles.weight, rtol=1e-4)
    np.testing.assert_allclose(rows[..., 1], 1.5 * means * tiles.weight, rtol=1e-4)


def test_a_tile_does_not_weigh_itself(picture):
    mask = np.ones((20, 24), bool)
    before = TileRows.of(picture, mask, 4).weight.reshape(5, 6, 3)
    brighter = picture.copy()
    brighter[8:12, 8:12] += 0.5
    after = TileRows.of(brighter, mask, 4).weight.reshape(5, 6, 3)
    assert np.all(after[2, 1] < 0.99 * before[2, 1])  # a neighbour counts less
    # the tile itself changes by the mean of the whole picture alone, a tenth of 0.5 / 30
    np.testing.assert_allclose(after[2, 2], before[2, 2], rtol=0.005)


def test_where_the_reference_is_clipped_only_a_darker_picture_counts(picture):
    mask, clipped = np.ones((20, 24), bool), np.zeros_like(picture)
    clipped[:4, :4] = 1.0
    tiles = TileRows.of(picture, mask, 4, clipped)
    flat = picture.reshape(-1, 3)[tiles.pixels]
    for factor in (2.0, 0.5):
        rows = tiles.rows(np.stack([factor * flat, np.ones_like(flat)], axis=-1)).reshape(len(tiles), 3, 2)
        assert np.all((rows[0] == 0.0) == (factor > 1.0))
        assert np.all(rows[1:] != 0.0)


@pytest.mark.parametrize("size", [1, 2, 4, 8])
def test_a_subset_is_the_same_pixels_for_every_size(picture, size):
    yy, xx = np.mgrid[:20, :24]
    mask = (yy - 10) ** 2 + (xx - 12) ** 2 < 81
    tiles = TileRows.of(picture, mask, size, most=120)
    expected = TileRows.of(picture, mask, 1, most=120)
    np.testing.assert_array_equal(np.sort(tiles.pixels), expected.pixels)
    assert len(tiles.pixels) < mask.sum()
