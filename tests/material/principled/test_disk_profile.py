# SPDX-License-Identifier: Apache-2.0
"""The profile of Christensen and Burley against quadrature and differences."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from scipy.integrate import quad

from mfo_backend.material.arrays.dual import Dual
from mfo_backend.material.principled.disk_profile import END, DiskProfile, leaving


@pytest.mark.parametrize("width", [1e-3, 0.7])
def test_all_light_leaves_before_the_end(width: float) -> None:
    def share(distance: float) -> float:
        return float(np.array(leaving(mi.Float64(width), mi.Float64(distance)))[0])

    assert quad(share, 0.0, END * width)[0] == pytest.approx(1.0, abs=1e-6)
    assert share(END * width * 1.001) == 0.0


def test_width_is_the_radius_over_four_pi() -> None:
    found = DiskProfile.of({"subsurface_radius": mi.Color3f(1.0, 0.2, 0.1), "subsurface_scale": mi.Float(0.5)}).width
    np.testing.assert_allclose(np.array(found).ravel(), np.array([1.0, 0.2, 0.1]) / (8.0 * np.pi), rtol=1e-6)


def test_what_was_found_beyond_the_end_of_a_channel_is_not_found_for_it() -> None:
    """Widths 1, 1, 0.1: at a distance of 2 that was found on the disk at 0.5 the last channel has not looked."""
    widths, on_disk = np.array([1.0, 1.0, 0.1]), 0.5
    density = (np.exp(-on_disk / widths) + np.exp(-on_disk / (3.0 * widths))) / widths
    share = density[:2].sum() / density.sum()
    found = DiskProfile(mi.Color3f(*widths.tolist())).carried(mi.Float(on_disk), mi.Float(2.0), mi.Float(0.0))
    alone = float(np.array(leaving(mi.Float(1.0), mi.Float(2.0)))[0])
    np.testing.assert_allclose(np.array(found).ravel(), [share * alone, share * alone, 0.0], rtol=1e-5)


def test_slopes_are_differences() -> None:
    step = 1e-3

    def carried(moved: float, *, slopes: bool = False) -> Any:
        values = {"subsurface_radius": mi.Color3f(1.0, 0.2, 0.1), "subsurface_scale": mi.Float(0.5 + moved)}
        held = [mi.Float(number) for number in (0.02, 0.03, 1.0)]
        if slopes:
            values = {k: Dual(v, {0: mi.Float(1.0)} if k == "subsurface_scale" else {}) for k, v in values.items()}
            held = [Dual(number) for number in held]
        return DiskProfile.of(values).carried(*held)

    found = np.array(carried(0.0, slopes=True).slopes[0]).ravel()
    expected = (np.array(carried(step)) - np.array(carried(-step))).ravel() / (2.0 * step)
    np.testing.assert_allclose(found, expected, rtol=0.01)
