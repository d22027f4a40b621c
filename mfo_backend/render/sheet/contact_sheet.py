# SPDX-License-Identifier: Apache-2.0
"""Where pictures of several sizes lie on one sheet, and how bright they are on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels

# Pixels that begin of a picture is a multiple of, and that at least lie between two: a multiple of every tile's side
# (`primary_rays.TILE`) and wider than what the filters of FLIP and of a blur (`fit.judge.verification.BLURRED`) reach
# at a silhouette
APART = 16


@dataclass(frozen=True)
class ContactSheet:
    """Pictures side by side, the first on the left; what lies between them is black and shows nothing.

    Attributes
    ----------
    sizes
        Height and width of each picture, pixels.
    gains
        What the radiance of each picture is multiplied with on the sheet, so that one that is lit dimly counts as much
        as the others.
    labels
        What each picture is called in sentences: its number, and its file where that is known.
    """

    sizes: tuple[tuple[int, int], ...]
    gains: tuple[float, ...]
    labels: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.sizes)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the sheet, multiples of `APART`."""
        return _up(max(height for height, _ in self.sizes)), self._columns[-1] + _up(self.sizes[-1][1])

    @property
    def _columns(self) -> tuple[int, ...]:
        """Where each picture begins."""
        widths = [_up(width) + APART for _, width in self.sizes]
        return tuple(sum(widths[:number]) for number in range(len(widths)))

    def cut(self, of_sheet: NDArray, number: int) -> NDArray:
        """The part of an array over the sheet's pixels that belongs to one picture, as it is on the sheet."""
        (height, width), column = self.sizes[number], self._columns[number]
        return of_sheet[:height, column : column + width]

    def picture(self, of_sheet: Pixels, number: int) -> Pixels:
        """A picture of its own radiance from that of the sheet."""
        return np.ascontiguousarray(self.cut(of_sheet, number) / np.float32(self.gains[number]))

    def put(self, parts: Sequence[NDArray]) -> NDArray:
        """An array over the sheet's pixels from those of all pictures, as they are; 0 between them."""
        whole = np.zeros((*self.shape, *parts[0].shape[2:]), parts[0].dtype)
        for number, part in enumerate(parts):
            self.cut(whole, number)[...] = part
        return whole

    def radiance(self, pictures: Sequence[Pixels]) -> Pixels:
        """The sheet of pictures of radiance, each with its gain."""
        return self.put([p * np.float32(gain) for p, gain in zip(pictures, self.gains, strict=True)])

    def on_sheet(self, pixels: NDArray[np.int64], number: int) -> NDArray[np.int64]:
        """Flat indices of the sheet for those of one picture."""
        row, column = np.divmod(pixels, self.sizes[number][1])
        return row * self.shape[1] + column + self._columns[number]

    def parted(self, pixels: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
        """For each picture with some of these flat indices of the sheet: its number, which of them, and its own ones.

        Those between the pictures belong to none.
        """
        row, column = np.divmod(pixels, self.shape[1])
        for number, ((height, width), begin) in enumerate(zip(self.sizes, self._columns, strict=True)):
            chosen = np.flatnonzero((row < height) & (column >= begin) & (column < begin + width))
            if len(chosen):
                yield number, chosen, row[chosen] * width + column[chosen] - begin

    def numbers(self, pixels: NDArray[np.int64]) -> NDArray[np.int64]:
        """The picture that each of these flat indices belongs to, -1 between them."""
        found = np.full(len(pixels), -1)
        for number, chosen, _ in self.parted(pixels):
            found[chosen] = number
        return found


def _up(length: int) -> int:
    return -(-length // APART) * APART
