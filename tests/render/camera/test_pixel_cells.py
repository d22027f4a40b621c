# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np

from mfo_backend.render.camera.pixel_cells import PixelCells


def area(cells: PixelCells, pixels: int) -> np.ndarray:
    return np.bincount(cells.position, cells.side.astype(np.float64) ** 2, pixels)


def test_a_grid_fills_each_pixel_row_by_row():
    cells = PixelCells.grid(np.array([2, 1, 3]))
    np.testing.assert_array_equal(np.bincount(cells.position), [4, 1, 9])
    np.testing.assert_allclose(area(cells, 3), 1.0, atol=1e-6)
    np.testing.assert_allclose(cells.x[:4], [0.0, 0.5, 0.0, 0.5])
    np.testing.assert_allclose(cells.y[:4], [0.0, 0.0, 0.5, 0.5])


def test_quarters_fill_the_cells_they_come_from():
    cells = PixelCells.grid(np.array([2, 1]))
    quarters = cells.take(np.array([3])).quarters()
    np.testing.assert_allclose(quarters.x, [0.5, 0.75, 0.5, 0.75])
    np.testing.assert_allclose(quarters.y, [0.5, 0.5, 0.75, 0.75])
    whole = PixelCells.joined([cells.take(np.array([0, 1, 2, 4])), quarters])
    assert len(whole) == 8
    np.testing.assert_allclose(area(whole, 2), 1.0, atol=1e-6)
