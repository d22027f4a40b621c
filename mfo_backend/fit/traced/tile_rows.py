# SPDX-License-Identifier: Apache-2.0
"""Weighted differences of pictures to a reference, averaged over tiles of pixels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels
from ..tolerances import DIM_FLOOR

Rows = NDArray[np.float32]


LARGEST_TILE = 8  # pixels: the largest tile
LEAST_CHOSEN = 6  # blocks of a picture of which some are looked at. No measurement
CHANNELS = 3  # of a tile follow each other and share its noise


@dataclass(frozen=True, eq=False)
class TileRows:
    """Pixels in tiles of `size` squared, what the reference shows there and how much a tile counts.

    Attributes
    ----------
    pixels
        Flat indices of the pixels, ordered by tile.
    first
        Where each tile's pixels begin.
    reference, weight
        Mean of the reference and weight (t, 3).
    clipped
        Where the reference is only a lower bound (t, 3).
    """

    pixels: NDArray[np.int64]
    first: NDArray[np.int64]
    reference: Rows
    weight: Rows
    clipped: NDArray[np.bool_]

    @staticmethod
    def of(
        reference: Pixels,
        mask: NDArray[np.bool_],
        size: int,
        clipped: Pixels | None = None,
        most: int = 1 << 30,
        *,
        noise: Pixels | None = None,
    ) -> TileRows:
        """Tiles of all pixels in `mask`; where these are more than `most`, of evenly spread blocks of pixels.

        Differences count relative to the radiance around a tile, or to a pixel's `noise`, its variance.
        """
        height, width = mask.shape
        pixel = np.flatnonzero(mask.ravel())
        row, column = np.divmod(pixel, width)
        columns = -(-width // size)
        tile = row // size * columns + column // size
        order = np.argsort(tile, kind="stable")
        pixel, tile = pixel[order], tile[order]
        first = np.flatnonzero(np.diff(tile, prepend=-1))
        count = np.diff(np.append(first, len(pixel)))
        flat = reference.reshape(-1, 3)
        sums = np.add.reduceat(flat[pixel].astype(np.float64), first, axis=0)
        if noise is None:
            weight = _weights(sums, count, tile[first], columns, -(-height // size))
        else:
            weight = (np.add.reduceat(noise.reshape(-1, 3)[pixel], first, axis=0) / count[:, None]) ** -0.5
        # small tiles at the silhouette are noisier
        weight *= np.sqrt(count / count.max())[:, None]
        limit = np.zeros((len(first), 3), bool)
        if clipped is not None:
            limit = np.maximum.reduceat(clipped.reshape(-1, 3)[pixel], first, axis=0) > 0
        mean = sums / count[:, None]
        keep = np.flatnonzero(_some_blocks(mask, most).ravel()[pixel[first]])
        chosen = np.concatenate([np.arange(first[k], first[k] + count[k]) for k in keep])
        begin = np.concatenate([[0], np.cumsum(count[keep])[:-1]])
        return TileRows(
            pixel[chosen], begin, mean[keep].astype(np.float32), weight[keep].astype(np.float32), limit[keep]
        )

    def __len__(self) -> int:
        return len(self.first)

    @cached_property
    def _count(self) -> NDArray[np.int64]:
        return np.diff(np.append(self.first, len(self.pixels)))

    def means(self, table: Rows) -> Rows:
        """Means over the tiles (t, 3, ...) of pixels (p, 3, ...)."""
        sums = np.add.reduceat(table.reshape(len(self.pixels), -1), self.first, axis=0)
        return (sums / self._count[:, None].astype(np.float32)).reshape(len(self), *table.shape[1:])

    def rows(self, table: Rows) -> Rows:
        """Weighted residual and derivatives (3 t, 1 + k) of pixels (p, 3, 1 + k), 0 for clipped tiles as bright."""
        tiles = self.means(table)
        tiles[..., 0] -= self.reference
        tiles[self.clipped & (tiles[..., 0] >= 0.0)] = 0.0
        return (tiles * self.weight[..., None]).reshape(3 * len(self), -1)


def _some_blocks(mask: NDArray[np.bool_], most: int) -> NDArray[np.bool_]:
    """Pixels (height, width) of evenly spread blocks that hold about `most` pixels of the mask."""
    count = int(mask.sum())
    if count <= most:
        return np.ones_like(mask)
    rows, columns = (-(-n // LARGEST_TILE) for n in mask.shape)
    padded = np.zeros((rows * LARGEST_TILE, columns * LARGEST_TILE), bool)
    padded[: mask.shape[0], : mask.shape[1]] = mask
    filled = np.flatnonzero(padded.reshape(rows, LARGEST_TILE, columns, LARGEST_TILE).any(axis=(1, 3)).ravel())
    wanted = min(max(round(len(filled) * most / count), LEAST_CHOSEN), len(filled))
    chosen = np.zeros(rows * columns, bool)
    chosen[filled[np.linspace(0, len(filled) - 1, wanted).astype(int)]] = True
    whole = np.repeat(np.repeat(chosen.reshape(rows, columns), LARGEST_TILE, 0), LARGEST_TILE, 1)
    return whole[: mask.shape[0], : mask.shape[1]]


def _weights(sums, count, tile, columns: int, rows: int) -> NDArray[np.float64]:
    """1 / (0.1 mean + L), L the mean of the eight tiles around.

    A tile's own value may not weigh it: where noise is low it would count more, and every fit would end too dark.
    """
    grid = np.zeros((rows + 2, columns + 2, 4))
    r, c = np.divmod(tile, columns)
    grid[r + 1, c + 1, :3] = sums
    grid[r + 1, c + 1, 3] = count
    total = -grid
    for dr in (-1, 0, 1):
        for dc in (-1, 0, 1):
            total = total + np.roll(grid, (dr, dc), (0, 1))
    around = total[r + 1, c + 1]
    mean = sums.sum(axis=0) / count.sum()
    local = np.where(around[:, 3:] > 0, around[:, :3] / np.maximum(around[:, 3:], 1.0), mean)
    return 1.0 / (DIM_FLOOR * max(float(mean.mean()), 1e-12) + local)
