# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.choose_groups import (
    BRIGHTEST,
    FINEST,
    GRID_DETAIL,
    GRID_EDGE,
    GRID_PLAIN,
    detail_grid,
    solution_grid,
    thinned_grid,
)


def test_rays_go_where_the_picture_changes_within_a_pixel():
    image = np.full((20, 20, 3), 0.5, np.float32)
    image[4, 4:8] = 0.58  # a soft step
    image[15, 4:8] = 1.1
    mask = np.zeros((20, 20), bool)
    mask[2:18, 2:18] = True
    image[~mask] = 0.0
    grid = detail_grid(image, mask)
    assert grid[4, 4] == GRID_DETAIL
    assert grid[15, 5] == GRID_EDGE
    assert grid[2, 10] == GRID_DETAIL  # the silhouette takes more rays, but not the most
    assert grid[13, 13] == GRID_PLAIN
    assert (grid[~mask] == GRID_PLAIN).all()


def test_a_target_within_a_pixel_is_not_missed():
    mask = np.zeros((6, 6), bool)
    mask[3, 3] = True
    grid = detail_grid(np.full((6, 6, 3), 0.2, np.float32), mask)
    assert grid[3, 3] == GRID_EDGE
    assert (grid[~mask] == GRID_PLAIN).all()


def test_a_black_picture_has_no_detail():
    assert (detail_grid(np.zeros((6, 6, 3), np.float32), np.ones((6, 6), bool)) == GRID_PLAIN).all()


def test_the_solution_is_recorded_more_finely_where_it_has_detail_unless_that_is_too_much():
    flat, spot = np.full((20, 20, 3), 0.5, np.float32), np.full((20, 20, 3), 0.5, np.float32)
    spot[10, 10] = 5.0
    mask = np.ones((20, 20), bool)
    grid = solution_grid(flat, mask, lambda: spot)
    assert grid[10, 10] == min(2 * GRID_EDGE, FINEST)
    assert grid[2, 2] == 2 * GRID_PLAIN
    wide = np.ones((400, 400), bool)  # 640 000 rays

    def never():
        raise AssertionError("not asked for")

    assert solution_grid(np.full((400, 400, 3), 0.5, np.float32), wide, never) is None


def wide_target():
    """A target of 590 x 590 pixels, a third of it dark, with a bright spot."""
    image = np.full((600, 600, 3), 0.5, np.float32)
    image[:, 400:] = 0.0
    image[300:310, 100:110] = 20.0
    mask = np.zeros((600, 600), bool)
    mask[5:595, 5:595] = True
    return image, mask


def test_a_large_target_is_thinned_evenly_and_keeps_what_is_brightest():
    image, mask = wide_target()
    grid = np.full(mask.shape, GRID_PLAIN)
    thin = thinned_grid(grid, image, mask, 80_000)
    kept = thin > 0
    assert not kept[~mask].any()
    assert kept[300:310, 100:110].all()
    lit = mask & (image[:, :, 0] > 0.0)
    assert np.square(thin)[lit].sum() == pytest.approx(80_000 + GRID_PLAIN**2 * BRIGHTEST, rel=0.01)
    share = 80_000 / np.square(grid)[lit].sum()
    kept[300:310, 100:110] = False
    blocks = kept[10:390, 10:390].reshape(19, 20, 19, 20).sum(axis=(1, 3)) / 400
    np.testing.assert_allclose(np.median(blocks), share, rtol=0.05)
    assert blocks.std() < 0.6 * np.sqrt(share * (1 - share) / 400)  # of pixels chosen at random
    # no row and no column is left out
    assert kept[10:590, 10:390].any(axis=0).all()
    assert kept[10:590, 10:390].any(axis=1).all()


@pytest.mark.parametrize("rays", [10**7, 900_000])
def test_where_most_pixels_would_stay_all_do(rays):
    image, mask = wide_target()
    grid = np.full(mask.shape, GRID_PLAIN)
    np.testing.assert_array_equal(thinned_grid(grid, image, mask, rays), grid)


def test_a_target_whose_solution_is_recorded_more_finely_is_not_thinned():
    image, mask = wide_target()
    image, mask = image[::6, ::6], mask[::6, ::6]
    grid = np.full(mask.shape, GRID_PLAIN)
    assert solution_grid(image, mask, lambda: image) is not None
    np.testing.assert_array_equal(thinned_grid(grid, image, mask, 1000), grid)
