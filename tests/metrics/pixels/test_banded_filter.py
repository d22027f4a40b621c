# SPDX-License-Identifier: Apache-2.0
"""Banded filters against scipy, and their adjoints as transposes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from mfo_backend.metrics.pixels.banded_filter import BandedFilter


@pytest.mark.parametrize("taps", [1, 5, 21])
@pytest.mark.parametrize("length", [1, 3, 40, 160, 161, 300])
def test_filter_and_adjoint(length, taps):
    """Lengths up to 160 are one block, 161 and 300 several; the border is replicated as scipy's `nearest`."""
    rng = np.random.default_rng(length + taps)
    kernel = rng.standard_normal(taps)
    banded = BandedFilter(kernel, length, np.float64)
    tall, wide = rng.standard_normal((2, length, 6)), rng.standard_normal((2, 6, length))
    np.testing.assert_allclose(banded.along_y(tall), correlate1d(tall, kernel, axis=-2, mode="nearest"), atol=1e-12)
    np.testing.assert_allclose(banded.along_x(wide), correlate1d(wide, kernel, axis=-1, mode="nearest"), atol=1e-12)
    other_tall, other_wide = rng.standard_normal(tall.shape), rng.standard_normal(wide.shape)
    assert np.vdot(banded.along_y(tall), other_tall) == pytest.approx(np.vdot(tall, banded.adjoint_along_y(other_tall)))
    assert np.vdot(banded.along_x(wide), other_wide) == pytest.approx(np.vdot(wide, banded.adjoint_along_x(other_wide)))
