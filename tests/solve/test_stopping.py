# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math

import pytest

from mfo_backend.solve.stopping import Stopping, StoppingRules
from mfo_backend.types.status import Status


def run(losses, **rules) -> tuple[Status | None, int]:
    stopping = Stopping(StoppingRules(**rules))
    for loss in losses:
        status = stopping.observe(loss)
        if status is not None:
            return status, stopping.iterations
    return None, stopping.iterations


def test_a_loss_that_does_not_change_for_ten_iterations_stops_at_the_eleventh() -> None:
    assert run([1.0] * 50) == (Status.UNCHANGED, 11)


def test_zero_counts_as_unchanged() -> None:
    assert run([0.0] * 50) == (Status.UNCHANGED, 11)


def test_ten_iterations_without_a_better_best_stop_the_stage() -> None:
    losses = [3.0, 2.0, 1.0] + [1.5 + 0.1 * (i % 3) for i in range(50)]
    assert run(losses) == (Status.STALE, 13)


def test_an_improvement_in_the_tenth_iteration_starts_the_count_anew() -> None:
    losses = [1.0, *[1.5, 1.6] * 4, 1.5, 0.9, *[1.5, 1.6] * 10]
    assert run(losses) == (Status.STALE, 11 + 10)


def test_the_maximum_counts_evaluated_iterates() -> None:
    assert run((1.0 / (i + 1) for i in range(50)), max_iterations=20) == (Status.MAX_ITERATIONS, 20)


def test_a_rule_that_fires_with_the_maximum_names_itself() -> None:
    assert run([1.0] * 50, max_iterations=11) == (Status.UNCHANGED, 11)


@pytest.mark.parametrize(("gain", "expected"), [(0.99e-5, (Status.STALE, 11)), (1.2e-5, (None, 40))])
def test_small_gains_add_up_to_the_threshold(gain: float, expected: tuple) -> None:
    # ten gains of 0.99e-5 stay below 1e-4, nine of 1.2e-5 exceed it
    losses = [1.0 - gain * i for i in range(11)] if gain < 1e-5 else [1.0 - gain * i for i in range(40)]
    assert run(losses) == expected


def test_noise_below_float32_resolution_counts_as_unchanged() -> None:
    assert run([1.0 + 5e-7 * (i % 2) for i in range(50)]) == (Status.UNCHANGED, 11)


def test_losses_that_are_not_finite_never_improve() -> None:
    assert run([math.nan] * 50) == (Status.STALE, 10)
    assert run([1.0] + [math.inf, math.nan] * 20) == (Status.STALE, 11)


def test_resume_gives_ten_more_iterations_and_keeps_the_best() -> None:
    stopping = Stopping(StoppingRules())
    for loss in [1.0, *[2.0, 2.1] * 5]:
        status = stopping.observe(loss)
    assert status is Status.STALE
    stopping.resume()
    statuses = [stopping.observe(1.5 + 0.01 * (i % 2)) for i in range(10)]
    assert statuses == [None] * 9 + [Status.STALE]
    assert stopping.iterations == 21


@pytest.mark.parametrize("rules", [{"patience": 0}, {"max_iterations": 0}, {"change": -1.0}, {"improvement": 1.0}])
def test_impossible_rules_are_refused(rules: dict) -> None:
    with pytest.raises(ValueError, match="must"):
        StoppingRules(**rules)
