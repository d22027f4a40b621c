# SPDX-License-Identifier: Apache-2.0
"""Rays of a recording: as many as its own noise asks for, and no more than lanes allow."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.recorded.finer_grid import finer_grid

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
