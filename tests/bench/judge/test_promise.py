# SPDX-License-Identifier: Apache-2.0
"""What counts as a kept and as a broken promise of a certainty."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.bench.judge.promise import inside, is_wrongly_determined, miss
from mfo_backend.types.parameter import Parameter

IOR = Parameter("ior", 1, 1.0, 2.5, 1.5)  # "determined" promises a fiftieth of the box: 0.03


@pytest.mark.parametrize(
    ("missed", "sd", "wrong"),
    [(0.029, 0.001, False), (0.031, 0.001, True), (0.059, 0.02, False), (0.061, 0.02, True)],
)
def test_a_determined_value_is_wrong_by_its_deviation_and_by_the_promise(missed: float, sd: float, wrong: bool) -> None:
    assert is_wrongly_determined(np.array([missed]), [sd], IOR) is wrong


def test_one_wrong_channel_makes_a_colour_wrong() -> None:
    colour = Parameter("base_color", 3, 0.0, 1.0, (0.5, 0.5, 0.5))
    missed = miss([0.5, 0.5, 0.6], [0.5, 0.51, 0.5], colour)
    np.testing.assert_allclose(missed, [0.0, 0.01, 0.1], atol=1e-15)
    assert is_wrongly_determined(missed, [0.01, 0.01, 0.01], colour)
    assert inside(missed, [0.01, 0.005, 0.06]) == 2  # 0, 2 and 1.7 deviations


def test_the_best_that_the_box_has_is_no_miss() -> None:
    assert miss([2.5], [3.0], IOR) == pytest.approx([0.0])
