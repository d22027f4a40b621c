# SPDX-License-Identifier: Apache-2.0
"""Squares inside pixels: where camera rays start, and how much of its pixel each one stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class PixelCells:
    """Squares that fill pixels without overlap.

    Attributes
    ----------
    position
        Which pixel a cell lies in (c,), counted in tile order.
    x, y, side
        Its corner next to the pixel's own and its side, in widths of the pixel (c,).
    """

    position: NDArray[np.uint32]
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    side: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.position)

    @staticmethod
    def grid(per_axis: NDArray[np.int64]) -> PixelCells:
        """`per_axis` (p,) squared equal cells in each pixel, row by row."""
        count = per_axis**2
        position = np.repeat(np.arange(len(per_axis)), count)
        number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        cells = per_axis[position]
        side = 1.0 / cells
        y, x = np.divmod(number, cells)
        return PixelCells(*_arrays(position, x * side, y * side, side))

    def take(self, index: NDArray) -> PixelCells:
        """Some of the cells, by number or by a mask."""
        return PixelCells(self.position[index], self.x[index], self.y[index], self.side[index])

    def quarters(self) -> PixelCells:
        """Four cells of half the side for each cell."""
        position, x, y, side = (np.repeat(a, 4) for a in (self.position, self.x, self.y, 0.5 * self.side))
        right, up = np.tile([0, 1, 0, 1], len(self)), np.tile([0, 0, 1, 1], len(self))
        return PixelCells(*_arrays(position, x + right * side, y + up * side, side))

    @staticmethod
    def joined(parts: list[PixelCells]) -> PixelCells:
        """All cells of several."""
        columns = zip(*((part.position, part.x, part.y, part.side) for part in parts), strict=True)
        return PixelCells(*(np.concatenate(column) for column in columns))


def _arrays(position, x, y, side) -> tuple[NDArray, ...]:
    return position.astype(np.uint32), *(a.astype(np.float32) for a in (x, y, side))
