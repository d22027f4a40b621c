# SPDX-License-Identifier: Apache-2.0
"""Traced pictures that are linear in the values, for stages on what noise must have no part in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import View
from ...render.camera.primary_rays import TILE
from ...render.paths.recorded_image import TwoSamples
from ...types.image import Image, Pixels
from ...types.parameter import Vector
from ..judge.model_gap import model_gap
from ..random_streams import Stream
from .pictures import TracedTiles

WORTH = 0.02  # relative difference of blocks of pixels that noise does not explain; less is hard to see
MOST_PIXELS = 1 << 16  # whole pictures are needed; of more pixels one takes too long
# Of a half of a picture. With fewer, noise decides some results (docs/notebook/glass.md); with a quarter, a difference
# of 4 % is found in half of the pictures of 48 x 48 pixels only
HALF_PATHS = 1 << 19
HALF_SAMPLES = (4, 32)  # of a pixel, at least and at most
LINEAR_WITHIN = 0.1  # of the range: as far as one linear picture is trusted

Rows = NDArray[np.float32]


class LinearPictures:
    """Whole pictures of the target with many paths a pixel, and their derivatives, as `pictures` traces them.

    Noise is no part of a search on them: a picture and its derivatives are traced once, and what is minimised is a
    measure of y + J (x - at) within `LINEAR_WITHIN`.
    """

    def __init__(self, pictures: TracedTiles, seed: int) -> None:
        # tiles average noise before the response of an eye bends it
        self.tiles = pictures.tiles(TILE, pictures.mask.size)
        self.width = pictures.paths.table.width
        self._pictures, self._seed = pictures, seed
        self._samples = int(np.clip(HALF_PATHS // max(len(self.tiles.pixels), 1), *HALF_SAMPLES))

    def are_worth_it(self, start: Vector, reference: Image, view: View) -> bool:
        """Whether the picture at `start` differs from the reference by more than noise explains and an eye sees.

        It is not where the reference is compared at equal counts (its noise is all there is to see) or the target is
        too large, nor after a request to stop.
        """
        if self._pictures.counts is not None or len(self.tiles.pixels) > MOST_PIXELS:
            return False
        halves = self._traced(start, 0)
        if halves is None:
            return False
        first, second = (self.whole(half[..., 0]) for half in halves)
        gap = model_gap(reference, (first, second), self._pictures.mask, view)
        return gap is not None and gap.relative >= WORTH

    def around(self, x: Vector, turn: int) -> LinearPicture | None:
        """The picture near `x`, for each `turn` from 1 on with other random numbers; None on a request to stop."""
        halves = self._traced(x, turn)
        return None if halves is None else LinearPicture(halves, x, self)

    def box(self, x: Vector, kept: NDArray[np.bool_]) -> tuple[Vector, Vector]:
        """Bounds around `x`; the values of `kept` stay."""
        table = self._pictures.paths.table
        reach = np.where(kept, 0.0, LINEAR_WITHIN * self.width)
        return np.maximum(table.lower, x - reach), np.minimum(table.upper, x + reach)

    def whole(self, rows: NDArray[np.floating]) -> Pixels:
        """The reference with the values (p, 3) in the pixels of the tiles."""
        image = self._pictures.reference.copy()
        image.reshape(-1, 3)[self.tiles.pixels] = rows
        return image

    def _traced(self, x: Vector, turn: int) -> tuple[Rows, Rows] | None:
        seed, pictures = Stream.LINEAR_PICTURES.seed(self._seed, turn), self._pictures
        table = pictures.tables(self.tiles.pixels, x[None], seed, self._samples, jacobian=turn > 0)
        if pictures.should_stop():
            return None
        first, second = np.split(table[0], 2)
        return first, second


class LinearPicture:
    """The picture y + J (x - at) of rows (p, 3, 1 + k), whose two halves have nothing random in common."""

    def __init__(self, halves: tuple[Rows, Rows], at: Vector, pictures: LinearPictures) -> None:
        self._halves, self._at, self._pictures = halves, at, pictures
        rows = 0.5 * (halves[0] + halves[1])
        self._image, self._jacobian = rows[..., 0], rows[..., 1:]

    def image(self, x: Vector) -> Pixels:
        """The whole picture of a vector."""
        return self._pictures.whole(self._image + self._jacobian @ self._way(x))

    def __call__(self, x: Vector) -> tuple[Pixels, Callable[[Pixels], Vector]]:
        """The same, and the pullback of a gradient by it."""
        return self.image(x), lambda gradient: np.einsum(
            "pc,pck->k", gradient.reshape(-1, 3)[self._pictures.tiles.pixels], self._jacobian, dtype=np.float64
        )

    def of_tiles(self) -> Callable[[Vector], TwoSamples]:
        """A function to the tiles of a picture with their derivatives, and to half the difference of its halves."""
        first, second = (self._pictures.tiles.means(half) for half in self._halves)
        parts = 0.5 * (first + second), 0.5 * (first - second)

        def at(x: Vector) -> TwoSamples:
            mean, half_difference = (part.copy() for part in parts)
            for rows in (mean, half_difference):
                rows[..., 0] += rows[..., 1:] @ self._way(x)
            return TwoSamples(mean, half_difference)

        return at

    def _way(self, x: Vector) -> Rows:
        return (x - self._at).astype(np.float32)
