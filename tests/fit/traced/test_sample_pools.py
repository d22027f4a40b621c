# SPDX-License-Identifier: Apache-2.0
"""Samples pooled over several sizes of tiles. Oracles: least squares without noise, and the scatter of solutions."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.traced.sample_pools import TilePools
from mfo_backend.fit.traced.tile_rows import TileRows
from mfo_backend.solve.noisy_least_squares import SafeMatrix, cautious_step, cross_equations

SIDE, WIDTH = 32, np.ones(2)
TRUE = np.array([0.2, -0.1])
SIZES = (1, 2, 4, 8)


def pools_of(reference):
    mask = np.ones((SIDE, SIDE), bool)
    return TilePools.of((TileRows.of(reference, mask, size) for size in SIZES), 3)


def scene(fine: bool, seed=0):
    """A picture (p, 3) at the start and its two derivatives (p, 3, 2), smooth or with a sign that changes by pixel."""
    y, x = np.mgrid[:SIDE, :SIDE] / SIDE
    columns = np.stack([1.0 + 0.5 * x, 1.0 - 0.7 * y], axis=-1)
    if fine:
        columns *= (np.indices((SIDE, SIDE)).sum(axis=0) % 2 * 2 - 1)[..., None]
    columns = np.repeat(columns.reshape(-1, 1, 2), 3, axis=1)
    return np.full((SIDE * SIDE, 3), 2.0), columns


def sample(rng, picture, columns, noise, of_columns):
    table = np.concatenate([picture[..., None], columns], axis=-1)
    spread = np.array([noise, of_columns, of_columns])
    return (table + spread * rng.normal(size=table.shape)).astype(np.float32)


def filled(fine, noise=0.3, of_columns=0.3, reference_noise=0.3, count=6, seed=0):
    rng = np.random.default_rng(seed)
    picture, columns = scene(fine)
    reference = picture + columns @ TRUE
    reference = reference + reference_noise * rng.normal(size=reference.shape)
    pools = pools_of(reference.reshape(SIDE, SIDE, 3).astype(np.float32))
    pools.add([sample(rng, picture, columns, noise, of_columns) for _ in range(count)])
    return pools


@pytest.mark.parametrize(("fine", "of_columns", "expected"), [(True, 0.3, {0}), (False, 8.0, {1, 2, 3})])
def test_the_size_is_the_one_that_says_most(fine, of_columns, expected):
    pools = filled(fine, of_columns=of_columns)
    equations, noise, size = pools.best(WIDTH)
    assert size in expected  # detail of a pixel is lost in tiles; noise of a pixel is averaged in them
    step = cautious_step(equations, -WIDTH, WIDTH, WIDTH, 0.0, noise)
    assert np.all(np.abs(step - TRUE) < 0.25)


def test_the_expected_error_is_that_of_the_solutions():
    _, columns = scene(False)
    stated, found = [], []
    for seed in range(40):
        pools = filled(False, seed=seed)
        equations, noise, size = pools.best(WIDTH)
        step = cautious_step(equations, -WIDTH, WIDTH, WIDTH, 0.0)
        pools.shifted(step)
        error = pools.expected_error(equations, noise, size, WIDTH)
        stated.append(error.total / error.there)
        found.append(np.mean((columns @ (step - TRUE)) ** 2) / 0.3**2)
    assert 0.4 < np.median(stated) / np.mean(found) < 2.0  # 40 solutions, and the weights are those of noisy tiles


def test_the_expected_error_counts_what_tiles_do_not_show():
    rng = np.random.default_rng(0)
    picture, smooth = scene(False)
    checks = np.tile(np.indices((SIDE, SIDE)).sum(axis=0).reshape(-1, 1, 1) % 2 * 4 - 2, (1, 3, 2))
    columns = smooth + checks * smooth  # four times the square, all of it gone in tiles
    reference = picture + 0.3 * rng.normal(size=picture.shape)
    pools = pools_of(reference.reshape(SIDE, SIDE, 3).astype(np.float32))
    pools.add([sample(rng, picture, columns, 0.3, 3.0) for _ in range(30)])
    tile = cross_equations(pools.pools[2].gram())
    noise = pools.pools[2].gradient_noise(3)
    error = pools.expected_error(tile, noise, 2, WIDTH)
    assert error.total == pytest.approx(5.0 * SafeMatrix(tile, WIDTH).expected_error(noise), rel=0.4)
    assert error.there == pytest.approx(2.0 * cross_equations(pools.pools[0].gram()).cost)


def test_too_few_samples_promise_nothing():
    rng = np.random.default_rng(3)
    pools = pools_of(np.full((SIDE, SIDE, 3), 2.0, np.float32))
    picture, columns = scene(True)
    pools.add([sample(rng, picture, 0.0 * columns, 0.0, 50.0) for _ in range(2)])
    error = pools.expected_error(*pools.best(WIDTH), WIDTH)
    assert error.total == error.own == np.inf


@pytest.mark.parametrize(("noise", "reference_noise", "expected"), [(0.0, 0.3, 0.0), (2.0, 0.3, 0.88)])
def test_own_noise_is_told_from_the_references(noise, reference_noise, expected):
    pools = filled(True, noise, 0.0, reference_noise)
    pools.shifted(cautious_step(pools.best(WIDTH)[0], -WIDTH, WIDTH, WIDTH, 0.0))  # where no misfit is left
    error = pools.expected_error(*pools.best(WIDTH), WIDTH)
    assert error.own / error.total == pytest.approx(expected, abs=0.12)  # 4 / 6 of 4 / 6 + 0.09; squares of 3072 rows


def test_faded_samples_count_less():
    rng = np.random.default_rng(1)
    picture, columns = scene(False)
    reference = (picture + columns @ TRUE).reshape(SIDE, SIDE, 3).astype(np.float32)
    pools = pools_of(reference)
    pools.add([sample(rng, picture + 5.0, columns, 0.0, 0.0) for _ in range(2)])  # taken far from here
    pools.fade(1e-3)
    pools.add([sample(rng, picture, columns, 0.0, 0.0) for _ in range(2)])
    equations, _, _ = pools.best(WIDTH)
    np.testing.assert_allclose(cautious_step(equations, -WIDTH, WIDTH, WIDTH, 0.0), TRUE, atol=0.02)


def test_the_answer_to_a_change_of_the_pictures_is_that_of_least_squares():
    rng = np.random.default_rng(4)
    picture, columns = scene(False)
    pools = filled(False, noise=1e-4, of_columns=1e-4, reference_noise=1e-4)
    change = rng.normal(size=picture.shape) + 0.5 * columns[..., 0]
    for size, tiles in enumerate(pools.tiles):
        rows = tiles.means(columns[pools.order[size]].astype(np.float32)) * tiles.weight[..., None]
        aim = tiles.means(change[pools.order[size]][..., None].astype(np.float32))[..., 0] * tiles.weight
        expected = np.linalg.lstsq(rows.reshape(-1, 2), -aim.ravel(), rcond=None)[0]
        equations = cross_equations(pools.pools[size].gram())
        np.testing.assert_allclose(pools.answer(change, equations, size, WIDTH), expected, rtol=2e-3, atol=1e-4)
