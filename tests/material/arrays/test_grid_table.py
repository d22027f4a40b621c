# SPDX-License-Identifier: Apache-2.0
"""A table at a place the compiler knows is read from a slice, and is the same table. Oracle: scipy's interpolation."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from mfo_backend.material.arrays.grid_table import MOST_SLICES, GridTable


@pytest.mark.parametrize("place", [0.0, 0.31, 0.5, 0.999, 1.0])
def test_a_slice_holds_the_tables_values(plugin: Any, place: float) -> None:
    draw = np.random.default_rng(0)
    tables = draw.uniform(size=(2, 5, 4, 6))
    points = draw.uniform(size=(2, 200))
    table, axes = GridTable(*tables), [np.linspace(0, 1, n) for n in (5, 4, 6)]
    first, second = (mi.Float(p.astype(np.float32)) for p in points)
    choice = mi.UInt32(np.arange(200, dtype=np.uint32) % 2)
    for known in (True, False):
        last = mi.Float(place) if known else dr.opaque(mi.Float, place)
        got = np.array(table(first, second, last, choice=choice))
        where = np.stack([*points, np.full(200, place)], axis=1)
        each = [RegularGridInterpolator(axes, t)(where) for t in tables]
        np.testing.assert_allclose(got, np.where(np.arange(200) % 2, each[1], each[0]), atol=2e-6)  # float32 places
        assert len(table._slices) == 1


def test_a_place_that_is_differentiated_keeps_its_slope(plugin: Any) -> None:
    table = GridTable(np.array([[0.0, 2.0, 3.0], [1.0, 4.0, 9.0]]))
    place = mi.Float(0.25)
    dr.enable_grad(place)
    dr.backward(table(mi.Float(1.0), place))
    assert dr.grad(place)[0] == pytest.approx(6.0)


def test_the_number_of_slices_is_bounded(plugin: Any) -> None:
    table = GridTable(np.zeros((3, 3)))
    for k in range(2 * MOST_SLICES):
        table(mi.Float(0.5), mi.Float(k / (2 * MOST_SLICES)))
    assert len(table._slices) == MOST_SLICES
