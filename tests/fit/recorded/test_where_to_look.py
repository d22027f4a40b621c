# SPDX-License-Identifier: Apache-2.0

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.recorded.where_to_look import (
    FINEST,
    GRID_DETAIL,
    GRID_EDGE,
    GRID_PLAIN,
    MOST_BRIGHT,
    all_groups,
    detail_grid,
    edges_of_light,
    finer_grid,
    solution_grid,
    thinned_grid,
    without_fireflies,
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


def recorded(inside_lanes, silhouette_lanes):
    """A target of 8 x 8 pixels in a frame of 12 x 12, whose border is half background."""
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    from mfo_backend.render.paths.recorded_paths import RecordedPaths

    pixel = np.arange(144).reshape(12, 12)[2:10, 2:10].ravel()
    border = np.ones((8, 8), bool)
    border[1:-1, 1:-1] = False
    border = border.ravel()
    lanes = np.where(border, silhouette_lanes, inside_lanes)
    first = np.concatenate([[0], np.cumsum(lanes)])[None]
    coverage = np.where(border, 0.5, 1.0).astype(np.float32)
    return RecordedPaths(
        None, None, None, pixel, pixel // 16, first, coverage, np.zeros((12, 12, 3), np.float32)
    ), border


@pytest.mark.parametrize(("inside", "at_silhouette", "whole"), [(1.0, 0.5, False), (0.1, 1.0, True)])
def test_the_silhouette_counts_where_most_of_the_light_is(inside, at_silhouette, whole):
    paths, border = recorded(4, 4)
    reference = np.zeros((12, 12, 3), np.float32)
    reference.reshape(-1, 3)[paths.pixel] = np.where(border, at_silhouette, inside)[:, None]
    assert len(all_groups(paths, 1, reference)) == (64 if whole else 36)
    assert len(all_groups(paths, 1)) == 36
    paths.constant.reshape(-1, 3)[paths.pixel[border]] = at_silhouette  # all of it light of other things
    assert len(all_groups(paths, 1, reference)) == 36


def test_light_ends_at_the_silhouette_and_beside_what_is_dark():
    paths, _ = recorded(0, 4)
    groups = all_groups(paths, 1)
    assert len(groups) == 64  # hardly lit elsewhere
    edges = edges_of_light(paths, groups)
    expected = np.zeros((12, 12), bool)
    expected[1:11, 1:11] = True  # a pixel beyond the silhouette as well, for a sliver there
    expected[4:8, 4:8] = False
    np.testing.assert_array_equal(edges, expected)
    grid = detail_grid(np.full((12, 12, 3), 0.5, np.float32), np.ones((12, 12), bool), edges)
    np.testing.assert_array_equal(grid == GRID_EDGE, expected)
    finer = solution_grid(np.full((12, 12, 3), 0.5, np.float32), expected, lambda: np.zeros((12, 12, 3)), edges)
    assert (finer[expected] == 2 * GRID_EDGE).all()
    paths, _ = recorded(4, 4)
    assert edges_of_light(paths, all_groups(paths, 1)) is None


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
    assert np.square(thin)[lit].sum() == pytest.approx(80_000 + GRID_PLAIN**2 * MOST_BRIGHT, rel=0.01)
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


PLAN = RecordedPlan(
    too_noisy=0.07, low_noise=0.06, grid_finest=16, most_own=0.3, low_own=0.2, clean_lanes=1_000_000
)  # fmt: skip


def lanes_allow(pixels):
    return lambda lanes: int(math.sqrt(min(lanes, 6_000_000) / (4 * pixels)))


@pytest.mark.parametrize(
    ("noise", "share", "pixels", "expected"),
    [
        (0.05, 0.2, 4000, 4),  # quiet
        (0.09, 0.2, 4000, 6),  # 4 x 0.09 / 0.06
        (0.5, 0.2, 4000, 16),
        (0.5, 0.2, 20_000, 8),  # 6 million lanes
        (0.05, 0.4, 4000, 7),  # odds of 2 / 3 to 1 / 4: 2.7 times the rays
        (0.05, 1.0, 4000, 7),  # a million lanes
        (0.05, 1.0, 100, 16),
        (0.05, 1.0, 100_000, 4),  # never fewer
        (0.09, 1.0, 20_000, 6),  # what radiance asks for is not held back
    ],
)
def test_rays_for_the_noise(noise, share, pixels, expected):
    assert finer_grid(4, noise, share, PLAN, lanes_allow(pixels)) == expected


@pytest.mark.parametrize("share", [0.35, 0.5, 0.8])
def test_the_share_becomes_the_low_one(share):
    grid = finer_grid(4, 0.0, share, replace(PLAN, clean_lanes=10**9, grid_finest=100), lambda lanes: 1000)
    own = share * (4 / grid) ** 2
    after = own / (own + 1.0 - share)
    assert after <= PLAN.low_own
    coarser = share * (4 / (grid - 1)) ** 2
    assert coarser / (coarser + 1.0 - share) > PLAN.low_own


def test_a_plan_may_leave_the_share_alone():
    assert finer_grid(3, 0.0, 1.0, replace(PLAN, most_own=1.0), lanes_allow(100)) == 3


def test_a_single_bright_pixel_is_replaced_by_those_around_it():
    image = np.full((9, 9, 3), 0.5, np.float32)
    image[4, 4] = 40.0
    image[0, :] = 40.0  # a bright edge is none
    clean, count = without_fireflies(image, np.ones((9, 9), bool))
    assert count == 1
    np.testing.assert_allclose(clean[4, 4], 0.5)
    np.testing.assert_array_equal(clean[0], image[0])
