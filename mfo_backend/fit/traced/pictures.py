# SPDX-License-Identifier: Apache-2.0
"""Traced pictures and their derivatives as rows of tiles of the reference, for a fit on whole light paths.

The early stages trace each picture in two independent halves a and b. Products of the two, a^T b, hold no noise of
either, where those of one picture with itself would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels
from ...types.parameter import Vector
from ..tolerances import SIGNIFICANT
from .sample_count import EqualCounts, NoiseComparison, Recount, TwoPictures, equal_counts, recount
from .tile_rows import CHANNELS, LARGEST_TILE, TileRows

if TYPE_CHECKING:  # the modules need Mitsuba's variant to be set
    from ...render.sheet.traced_sheet import TracedSheet
    from ...render.traced.traced_paths import TracedPaths
from ...solve.bounded_least_squares import NormalEquations
from ...solve.noisy_least_squares import cross_equations

Samples = list[NDArray[np.float32]]

Rows = NDArray[np.float32]

BRIGHT = 10.0  # weighted residual: about eleven times the reference
GEOMETRIC = ("roughness", "ior")  # they move the paths
SECANT_BELOW = 0.25  # roughness; above it the derivative of a fixed path has less noise than a secant of moving ones
# Wide ones blur what they look at, narrow ones are noisy (docs/notebook/glass.md: 0.03 and 0.06 of the index)
SECANTS = {"roughness": 0.12, "ior": 0.045}


@dataclass(frozen=True, eq=False)
class TracedTiles:
    """Pictures of `paths` against a scene-linear `reference` (height, width, 3), in pixels of the `mask`.

    `clipped` is 1 where the reference is only a lower bound. With `counts`, for a noisy reference, all pictures and
    tiles are compressed.
    """

    paths: TracedPaths | TracedSheet
    reference: Pixels = field(repr=False)
    mask: NDArray[np.bool_] = field(repr=False)
    clipped: NDArray[np.float32] | None = field(repr=False)
    should_stop: Callable[[], bool]
    counts: EqualCounts | None = None

    def tiles(self, size: int, most: int) -> TileRows:
        """Tiles of the reference, compressed where pictures are compared so."""
        if self.counts is None:
            return TileRows.of(self.reference, self.mask, size, self.clipped, most)
        return TileRows.of(self.counts.reference, self.mask, size, most=most, noise=self.counts.noise)

    def halves(
        self,
        tiles: TileRows,
        xs: Vector,
        *,
        seed: int,
        samples: int,
        jacobian: bool = True,
        moving: bool = True,
    ) -> list[Samples]:
        """For each vector the weighted rows (3 t, 1 + k) of two independent halves of its paths.

        Without `moving` the derivatives by roughness and index stay those of fixed paths.
        """
        tables = self.tables(tiles.pixels, xs, seed, samples, jacobian, moving)
        return [[tiles.rows(half) for half in np.split(table, 2)] for table in tables]

    def tables(
        self,
        pixels: NDArray[np.int64],
        xs: Vector,
        seed: int,
        samples: int,
        jacobian: bool = True,
        moving: bool = True,
    ) -> NDArray[np.float32]:
        """Pictures with derivatives (m, 2 p, 3, 1 + k), the pixels twice."""
        pixels = np.concatenate([pixels, pixels])  # the second time with other random numbers

        def trace(vectors: Vector, derivatives: bool) -> NDArray[np.float32]:
            images = self.paths.images(
                vectors, pixels, seed=seed, samples=samples, jacobian=derivatives, should_stop=self.should_stop
            )
            return images if self.counts is None else self.counts.compress(images)

        tables = trace(xs, jacobian)
        if jacobian and moving:
            self._secants(tables, xs, trace)
        return tables

    def _secants(self, tables: NDArray[np.float32], xs: Vector, trace: Callable) -> None:
        """Replace the derivatives of sharp materials by what shifts the paths: secants with the same random numbers."""
        moved, where = [], []
        for i, x in enumerate(xs):
            if self.paths.roughness(x) >= SECANT_BELOW:
                continue
            for name in GEOMETRIC:
                if name not in self.paths.table.names:
                    continue
                k = self.paths.table.slice_of(name).start
                h = SECANTS[name]
                h = -h if x[k] + h > self.paths.table.upper[k] else h
                trial = x.copy()
                trial[k] += h
                moved.append(trial)
                where.append((i, k, h))
        if moved:
            images = trace(np.array(moved), False)[..., 0]
            for image, (i, k, h) in zip(images, where, strict=True):
                tables[i, :, :, 1 + k] = (image - tables[i, :, :, 0]) / h

    def counted(self, x: Vector, most: int, seed: int) -> TracedTiles:
        """The same, compared as the reference's noise asks for, judged by pictures of `x` in about `most` pixels."""
        pixels = replace(self, counts=None).tiles(LARGEST_TILE, most).pixels
        counts = equal_counts(self.reference, self.mask, pixels, self.clipped, self._linear(x, pixels, seed))
        return replace(self, counts=counts)

    def recount(self, x: Vector, pixels: NDArray[np.int64], seed: int) -> Recount | None:
        """What the noise in these pixels says at the end `x` of a fit; None where pictures are not compared so."""
        if self.counts is None:
            return None
        comparison = NoiseComparison(self.reference, pixels, self.mask.shape, self.counts.level, self.counts.top)
        return recount(self.counts, comparison, self._linear(x, pixels, seed))

    def _linear(self, x: Vector, pixels: NDArray[np.int64], seed: int) -> TwoPictures:
        plain = replace(self, counts=None)

        def pictures(samples: int, stream: int) -> NDArray[np.float32]:
            images = plain.tables(pixels, x[None], seed + stream, samples, jacobian=False)
            return images[0, ..., 0].reshape(2, -1, 3)

        return pictures


def two_half_equations(a: Rows, b: Rows) -> NormalEquations:
    """The normal equations of two samples of weighted rows (n, 1 + k), the residual and its derivatives.

    A residual above `BRIGHT` counts as that and has no derivative: the image of a sun in sharp glass flits over the
    tiles with every step, and a single tile then hides what all others say. Under `ph_kiara_1_dawn` the race of six
    random glasses ended, by their geometric mean, at 0.14 of the reference's noise (squares) instead of 0.24 with a
    limit of 3. But what is cut off is missing from the mean: with that limit races under contrasty probes ended too
    dark, and at 30 fireflies rule again (docs/notebook/glass.md).
    """
    first, second = _capped(a), _capped(b)
    product = first.T @ second / len(first)
    return cross_equations(0.5 * (product + product.T))


def is_unsure(a: Rows, b: Rows) -> bool:
    """Whether the mean square of two samples of the rows is less than three of its standard errors over tiles."""
    squares = (a[:, 0].astype(np.float64) * b[:, 0]).reshape(-1, CHANNELS).mean(axis=1)
    return bool(squares.mean() < np.sqrt(SIGNIFICANT / len(squares)) * squares.std())


def _capped(rows: Rows) -> NDArray[np.float64]:
    capped = rows.astype(np.float64)
    bright = capped[:, 0] > BRIGHT
    capped[bright] = 0.0
    capped[bright, 0] = BRIGHT
    return capped
