# SPDX-License-Identifier: Apache-2.0
"""Oracle: counts in equal boxes, and integrals that are known."""

from __future__ import annotations

import numpy as np
import pytest

COUNT = 64  # of a pixel


@pytest.fixture(scope="module")
def even_points():
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    import mitsuba as mi

    from mfo_backend.render.random_numbers.even_points import even_points

    def points(dimensions, first, block, seed):
        number = mi.UInt32(np.arange(first, first + COUNT, dtype=np.uint32))
        found = even_points(dimensions, number, mi.UInt32(block) + 0 * number, 8, seed)
        return np.array([np.array(u) for u in found])

    return points


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("first", [0, 1000, 6_000_000])
def test_every_run_fills_boxes_evenly(even_points, dimensions, first):
    u = even_points(dimensions, first, 3, seed=1)
    assert (u >= 0.0).all()
    assert (u < 1.0).all()
    side = 4 if dimensions == 2 else 2
    index = np.ravel_multi_index((u * side).astype(int), (side,) * dimensions)
    expected = COUNT / side**dimensions
    # random points leave one of sixteen boxes empty in a quarter of such runs
    assert np.abs(np.bincount(index, minlength=side**dimensions) - expected).max() <= 0.75 * expected


def test_a_smooth_integral_has_a_quarter_of_the_random_variance_and_no_bias(even_points):
    def mean(u):
        return float(np.mean(np.exp(u[0] - u[1] ** 2)))

    exact = (np.e - 1.0) * 0.746824132812427  # the integral of exp(-v^2) over [0, 1]
    even = np.array([mean(even_points(2, 0, block, seed)) for seed in range(8) for block in range(8)])
    rng = np.random.default_rng(0)
    random = np.array([mean(rng.random((2, COUNT))) for _ in range(64)])
    assert even.std() < 0.5 * random.std()
    assert even.mean() == pytest.approx(exact, abs=3.0 * even.std() / 8.0 + 1e-6)


def test_blocks_and_seeds_have_shifts_of_their_own(even_points):
    starts = {tuple(even_points(2, 0, block, seed)[:, 0]) for block in range(4) for seed in range(4)}
    assert len(starts) == 16
    np.testing.assert_array_equal(even_points(3, 7, 2, 5), even_points(3, 7, 2, 5))
