# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np

from mfo_backend.fit.choose_groups import FINEST, GRID_DETAIL, GRID_EDGE, GRID_PLAIN, detail_grid, solution_grid


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
