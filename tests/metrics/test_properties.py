# SPDX-License-Identifier: Apache-2.0
"""What holds for every picture: no loss is negative, equal pictures cost nothing, conversions have their inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mfo_backend.metrics.display.colour import linear_from_srgb, srgb_from_linear
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.losses.loss_names import LOSS_NAMES
from mfo_backend.types.image import Encoding, Image

SIZE = (8, 11, 3)
RADIANCE = st.just(0.0) | st.floats(2**-20, 2**14, width=32)
LINEAR = arrays.arrays(np.float32, SIZE, elements=RADIANCE)
UNIT = arrays.arrays(np.float64, (4, 3), elements=st.floats(0, 1))


@pytest.mark.parametrize("name", LOSS_NAMES)
def test_no_loss_is_negative_and_equal_pictures_cost_nothing(name: str) -> None:
    @given(reference=LINEAR, image=LINEAR)
    def check(reference: np.ndarray, image: np.ndarray) -> None:
        reference[0, 0] = 1.0  # a black reference is refused
        display = DisplayView() if name.endswith("-ldr") else None
        loss = make_loss(name, Image(reference, Encoding.LINEAR), display=display)
        value, gradient = loss.value_and_gradient(image)
        assert np.isfinite(value)
        assert value >= 0
        assert np.isfinite(gradient).all()
        assert value == pytest.approx(loss.value(image), rel=1e-5, abs=1e-12)
        assert loss.value(reference) == pytest.approx(0.0, abs=1e-12)

    check()


@given(display=UNIT)
def test_srgb_and_back(display: np.ndarray) -> None:
    # the two branches of IEC 61966-2-1 miss each other by 1e-7 where they meet
    np.testing.assert_allclose(srgb_from_linear(linear_from_srgb(display)), display, atol=2e-7)


@given(display=UNIT, exposure=st.floats(-8, 8), gamma=st.floats(0.5, 3))
def test_a_view_and_back(display: np.ndarray, exposure: float, gamma: float) -> None:
    view = DisplayView(exposure, gamma)
    # the root of a large gamma has a steep slope at black
    np.testing.assert_allclose(view.display(view.linear(display)), display, atol=1e-3 if gamma != 1 else 2e-7)
