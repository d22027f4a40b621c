# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.paper.loop import StagesOutcome, run_stages
from mfo_backend.fit.result.outcome import Candidate
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.types.event import Preview, Progress, StageEnd
from mfo_backend.types.status import Status


def never() -> bool:
    return False


def run(renderer, losses, *, listener=lambda event: None, should_stop=never, **settings) -> StagesOutcome:
    start = Candidate(renderer.start, renderer.image(renderer.start, seed=0, spp=16))
    return run_stages(renderer, losses, start, FitSettings(**settings), listener=listener, should_stop=should_stop)


@pytest.fixture
def mse(sphere, truth):
    return make_loss("mse-hdr", sphere.reference(truth))


class Scripted:
    """A loss that follows a list of values, whatever the picture; its gradient is that of `inner`."""

    def __init__(self, inner, values) -> None:
        self.name, self._inner, self._values = "scripted", inner, iter(values)

    def value_and_gradient(self, image):
        return next(self._values), self._inner.value_and_gradient(image)[1]


def test_recovers_the_truth(sphere, truth, mse) -> None:
    outcome = run(sphere, [mse], max_iterations=1000)
    np.testing.assert_allclose(outcome.candidates[-1].vector, truth, atol=5e-3)  # the last rate is 2e-3 of the range
    assert outcome.reports[0].loss_best < 1e-4 * outcome.reports[0].loss_start


def test_an_iteration_counts_three_passes(sphere, mse) -> None:
    run(sphere, [mse], max_iterations=7)
    assert sphere.passes == 1 + 6 * 3 + 1  # start picture, six steps, and the last iterate needs no slope


@pytest.mark.parametrize("keep", [False, True])
def test_a_new_stage_starts_from_the_best_with_fresh_or_kept_moments(sphere, mse, keep: bool) -> None:
    images = []

    class Recorded(Scripted):
        def value_and_gradient(self, image):
            images.append(image)
            return super().value_and_gradient(image)

    first = [5.0, 1.0, *[2.0, 2.1] * 5]  # the best is the second iterate
    second = [9.0 - 0.5 * i for i in range(12)]
    stages = [Recorded(mse, first), Recorded(mse, second)]
    run(sphere, stages, schedule="constant", max_iterations=12, keep_optimizer_state=keep)
    best, restart, stepped = images[1], images[12], images[13]
    np.testing.assert_array_equal(restart, best)
    # a fresh Adam steps by exactly the rate in every parameter, one with kept moments does not
    fresh = sphere.start.copy()
    _, gradient = mse.value_and_gradient(images[0])
    slope = sphere.image_and_pullback(fresh, seed=0, spp=1)[1](gradient)
    span = sphere.table.upper - sphere.table.lower
    first_step = fresh - 0.05 * span * np.sign(slope)
    slope = sphere.image_and_pullback(first_step, seed=0, spp=1)[1](mse.value_and_gradient(best)[1])
    second_step = first_step - 0.05 * span * np.sign(slope)
    expected = sphere.shade(second_step).astype(np.float32)
    assert np.allclose(stepped, expected, atol=1e-5) is not keep


def test_constant_rate_ends_at_the_first_stall_and_decay_takes_three_more(sphere, mse) -> None:
    values = [1.0, *[2.0, 2.1] * 40]
    constant = run(sphere, [Scripted(mse, values)], schedule="constant")
    decay = run(sphere, [Scripted(mse, values)], schedule="decay")
    assert (constant.status, constant.reports[0].iterations) == (Status.STALE, 11)
    assert (decay.status, decay.reports[0].iterations) == (Status.STALE, 41)
    np.testing.assert_array_equal(decay.candidates[-1].vector, sphere.start)


def test_a_stall_goes_on_from_the_best_with_a_third_of_the_rate(sphere, mse) -> None:
    images = []

    class Recorded(Scripted):
        def value_and_gradient(self, image):
            images.append(image)
            return super().value_and_gradient(image)

    run(sphere, [Recorded(mse, [1.0, *[2.0, 2.1] * 40])], schedule="decay", learning_rate=0.03, max_iterations=13)
    np.testing.assert_array_equal(images[11], images[0])
    first, again = (np.abs(images[i] - images[0]).max() for i in (1, 12))
    assert 0.2 < again / first < 0.5  # a third, up to the curvature of the picture


def test_the_maximum_holds_through_stalls(sphere, mse) -> None:
    outcome = run(sphere, [Scripted(mse, [1.0, *[2.0, 2.1] * 40])], max_iterations=11)
    assert outcome.reports[0].iterations == 11


def test_keeps_the_best_iterate_not_the_last(sphere, mse) -> None:
    outcome = run(sphere, [Scripted(mse, [3.0, 2.0, 1.0, *[2.0, 2.1] * 20])], schedule="constant")
    _, _, best = (point.loss for point in outcome.reports[0].curve[:3])
    assert outcome.reports[0].loss_best == best == 1.0
    expected = sphere.image(outcome.candidates[-1].vector, seed=0, spp=16)
    np.testing.assert_array_equal(outcome.candidates[-1].image, expected)


def test_steps_back_from_losses_that_are_not_finite(sphere, mse) -> None:
    values = [5.0, np.nan, 4.0, np.inf, 3.0, *[3.5, 3.6] * 5]
    outcome = run(sphere, [Scripted(mse, values)], schedule="constant")
    assert outcome.status is Status.STALE
    assert outcome.reports[0].loss_best == 3.0


def test_three_failures_in_a_row_end_the_fit_with_the_best(sphere, mse) -> None:
    outcome = run(sphere, [Scripted(mse, [5.0, 4.0, *[np.nan] * 5]), mse])
    assert outcome.status is Status.FAILED
    assert [report.iterations for report in outcome.reports] == [5]
    assert outcome.reports[0].loss_best == 4.0


def test_cancel_ends_at_once_and_keeps_the_best(sphere, mse) -> None:
    polls = iter([False] * 5 + [True] * 100)
    outcome = run(sphere, [mse, mse], should_stop=lambda: next(polls))
    assert outcome.status is Status.CANCELLED
    assert [report.iterations for report in outcome.reports] == [5]
    assert len(outcome.candidates) == 2
    assert outcome.reports[0].loss_best < outcome.reports[0].loss_start


def test_cancel_before_the_first_iteration_keeps_the_start(sphere, mse) -> None:
    outcome = run(sphere, [mse], should_stop=lambda: True)
    assert outcome.status is Status.CANCELLED
    np.testing.assert_array_equal(outcome.candidates[-1].vector, sphere.start)


def test_events_tell_the_whole_course(sphere, mse) -> None:
    events = []
    outcome = run(sphere, [mse, mse], listener=events.append, max_iterations=30)
    progress = [event for event in events if isinstance(event, Progress)]
    assert len(progress) == sum(report.iterations for report in outcome.reports)
    fractions = [event.fraction for event in progress]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert progress[-1].remaining_seconds == 0.0
    assert all(event.remaining_seconds >= 0.0 for event in progress)
    assert all(np.diff([event.best for event in progress if event.stage_index == 0]) <= 0.0)
    assert sum(isinstance(event, Preview) for event in events) >= 1
    ends = [event for event in events if isinstance(event, StageEnd)]
    assert [end.sentence for end in ends] == [Status(end.status).sentence for end in ends]
    curve = outcome.reports[1].curve
    assert [point.iteration for point in curve] == list(range(1, len(curve) + 1))
    # an iterate at which a stall ends has no need of its slope
    assert set(np.diff([point.passes for point in curve])) == {1.0, 3.0}


def test_equal_seeds_give_equal_fits(noisy_sphere, sphere, truth) -> None:
    loss = make_loss("mse-hdr", sphere.reference(truth))
    first, second = (run(noisy_sphere, [loss], max_iterations=20) for _ in range(2))
    np.testing.assert_array_equal(first.candidates[-1].vector, second.candidates[-1].vector)
