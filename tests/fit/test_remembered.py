# SPDX-License-Identifier: Apache-2.0
"""A remembered function is asked once for each vector, and forgets the oldest."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.remembered import RECALLED, Remembered


def counted():
    asked = []

    def evaluate(x):
        asked.append(x.copy())
        return np.full((2, 3, 1 + len(x)), x.sum(), np.float32)

    return Remembered(evaluate), asked


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
    evaluate.note(np.array([1.0]), np.ones((2, 3, 2), np.float32))
    assert evaluate(np.array([1.0])).max() == 1
    assert asked == []
