# SPDX-License-Identifier: Apache-2.0
"""One counter for all that renders; what is no part of a fit is left out, whatever happens there."""

from __future__ import annotations

import pytest

from mfo_backend.render.pictures.pass_counter import PassCounter


def test_what_is_no_part_of_a_fit_is_not_counted():
    counter = PassCounter()
    counter.add(1.5)
    with counter.uncounted():
        counter.add(10.0)
        with counter.uncounted():
            counter.add(10.0)
        counter.add(10.0)
    counter.add(0.25)
    assert counter.count == 1.75


def test_counting_goes_on_after_an_error():
    counter = PassCounter()
    with pytest.raises(ValueError, match="stopped"), counter.uncounted():
        raise ValueError("stopped")
    counter.add(1.0)
    assert counter.count == 1.0
