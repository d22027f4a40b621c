# SPDX-License-Identifier: Apache-2.0
"""What the numbers of a preset have to be to each other."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mfo_backend.fit.plans import RecordedPlan


@pytest.mark.parametrize("preset", ["fast", "balanced", "best"])
def test_a_recording_made_anew_is_better_than_what_made_it_so(preset):
    plan = RecordedPlan.of(preset)
    assert 0.0 < plan.low_noise < plan.too_noisy
    assert 0.0 < plan.low_own < plan.most_own
    assert plan.grid_last < plan.grid_finest
    # a new recording that is hardly better is a waste
    assert (plan.low_noise / plan.too_noisy) ** 2 < 0.75


def test_a_cheaper_preset_does_no_more():
    fast, balanced = RecordedPlan.of("fast"), RecordedPlan.of("balanced")
    for name in ("grid_last", "grid_finest", "starts", "refine_lanes", "basins"):
        assert getattr(fast, name) <= getattr(balanced, name), name
    for name in ("too_noisy", "low_noise", "most_own"):  # and is content with more noise
        assert getattr(balanced, name) <= getattr(fast, name), name
    assert RecordedPlan.of("best").same_cost == 0.0  # it goes on from several solutions


@pytest.mark.parametrize("preset", ["fast", "balanced", "best"])
def test_a_small_target_has_no_more_own_noise_than_in_balanced(preset):
    plan, balanced = RecordedPlan.of(preset), RecordedPlan.of("balanced")
    small = plan.of_a_small_target()
    assert small.most_own == balanced.most_own < 0.5  # or half of what is left is the recording's own
    assert replace(small, most_own=plan.most_own) == plan
