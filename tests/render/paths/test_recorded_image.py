# SPDX-License-Identifier: Apache-2.0
"""A recorded image is asked once for each vector, and forgets the oldest; its samples are told apart."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.plans import NEAR_EVALUATIONS
from mfo_backend.render.paths.recorded_image import RECALLED, RecordedImage, TwoSamples


def counted():
    asked = []

    def evaluate(x):
        asked.append(x.copy())
        return TwoSamples(np.full((2, 3, 1 + len(x)), x.sum(), np.float32), None)

    return RecordedImage(evaluate, RECALLED), asked


def test_an_answer_is_given_twice_and_found_once():
    evaluate, asked = counted()
    x = np.array([0.5, 0.25])
    first, again = evaluate(x), evaluate(x.copy())
    assert again is first
    assert len(asked) == 1
    assert evaluate(np.array([0.5, 0.26]))[0, 0, 0] == np.float32(0.76)
    assert len(asked) == 2


def test_answers_cannot_be_changed():
    evaluate, _ = counted()
    with pytest.raises(ValueError, match="read-only"):
        evaluate(np.zeros(2))[:] = 1


def test_the_oldest_answer_is_forgotten():
    evaluate, asked = counted()
    for k in range(RECALLED + 1):
        evaluate(np.array([float(k)]))
    evaluate(np.array([float(RECALLED)]))
    assert len(asked) == RECALLED + 1
    evaluate(np.array([0.0]))
    assert len(asked) == RECALLED + 2


def test_an_answer_found_in_another_way_is_taken_over():
    evaluate, asked = counted()
    evaluate.note(np.array([1.0]), TwoSamples(np.ones((2, 3, 2), np.float32), None))
    assert evaluate(np.array([1.0])).max() == 1
    assert asked == []


def test_mean_and_half_difference_give_both_samples_back():
    samples = np.random.default_rng(0).uniform(size=(2, 5, 3, 4)).astype(np.float32)
    constant = np.full((5, 3), 0.25, np.float32)
    two = TwoSamples.of(samples, constant)
    for sign, sample in zip((1, -1), samples, strict=True):
        expected = sample.copy()
        expected[:, :, 0] += constant
        np.testing.assert_allclose(two.mean + sign * two.half_difference, expected, atol=1e-6)


def test_a_single_sample_has_no_difference():
    two = TwoSamples.of(np.ones((1, 5, 3, 4), np.float32), np.ones((5, 3), np.float32))
    assert two.half_difference is None
    assert two.mean[:, :, 0].max() == 2


def test_groups_have_the_means_of_their_pixels():
    samples = np.random.default_rng(1).uniform(size=(2, 6, 3, 4)).astype(np.float32)
    two = TwoSamples.of(samples, np.zeros((6, 3), np.float32))
    averaged = two.averaged(lambda rows: rows.reshape(2, 3, 3, 4).mean(axis=1))
    expected = samples.reshape(2, 2, 3, 3, 4).mean(axis=2)
    np.testing.assert_allclose(averaged.mean, expected.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(averaged.half_difference, 0.5 * (expected[0] - expected[1]), atol=1e-6)


def test_a_glance_changes_nothing_that_is_known():
    evaluate, asked = counted()
    known = evaluate(np.array([1.0]))
    assert evaluate.glance(np.array([1.0])) is known
    assert len(asked) == 1
    evaluate.glance(np.array([2.0]))
    assert len(asked) == 2
    assert evaluate(np.array([1.0])) is known  # the only one that is kept
    assert len(asked) == 2
    evaluate(np.array([2.0]))
    assert len(asked) == 3


def test_where_a_solve_near_its_end_began_is_known_at_its_end():
    """It is compared with there, and the next one begins there."""
    evaluate, asked = counted()
    for k in range(NEAR_EVALUATIONS + 1):
        evaluate(np.array([float(k)]))
    evaluate(np.array([0.0]))
    assert len(asked) == NEAR_EVALUATIONS + 1
