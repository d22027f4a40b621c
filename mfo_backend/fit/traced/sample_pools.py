# SPDX-License-Identifier: Apache-2.0
"""Noisy pictures of one material with their derivatives, pooled over tiles of several sizes at once.

Small tiles show more of a sharp picture's detail, large ones average the noise before it is multiplied. Which size
says most changes as samples come in, so all of them are kept and the best is chosen anew each time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...solve.bounded_least_squares import NormalEquations
from ...solve.noisy_least_squares import CrossProducts, SafeMatrix, cross_equations
from ...types.parameter import Vector
from .tile_rows import CHANNELS, TileRows

MANY = 50  # the largest tiles of a picture of 128 x 128 are about 100; with the 38 of one of 64 x 64 fits got stuck


@dataclass(frozen=True)
class ExpectedError:
    """Mean squares of weighted, so relative, differences in single pixels.

    Attributes
    ----------
    total, own
        What noise leaves at the solution, and the part of it that more samples would take away; infinite while there
        are too few samples to tell.
    there
        What is there: the reference's noise once the fit is near, as products of different samples hold none of theirs.
    """

    total: float
    own: float
    there: float


@dataclass(frozen=True)
class TilePools:
    """Samples of the same pixels in tiles of growing size; the first are single pixels."""

    tiles: tuple[TileRows, ...]
    pools: list[CrossProducts]
    order: tuple[NDArray[np.int64], ...]  # of the pixels in each size

    @staticmethod
    def of(tiles: Iterable[TileRows], columns: int) -> TilePools:
        """Empty pools for pictures (p, 3, columns); the tiles are given by size, single pixels first."""
        tiles = tuple(tiles)
        order = tuple(np.searchsorted(tiles[0].pixels, t.pixels) for t in tiles)
        return TilePools(tiles, [CrossProducts(CHANNELS * len(t), columns) for t in tiles], order)

    @property
    def pixels(self) -> NDArray[np.int64]:
        """Flat indices of the pixels every sample has to hold, in this order."""
        return self.tiles[0].pixels

    def add(self, samples: Sequence[NDArray[np.float32]], weight: float = 1.0) -> None:
        """Take independent pictures with derivatives (p, 3, columns), each worth `weight` of others."""
        for tiles, pool, order in zip(self.tiles, self.pools, self.order, strict=True):
            for sample in samples:
                pool.add(tiles.rows(sample[order]), weight)

    def fade(self, factor: float) -> None:
        """Multiply the weight of all samples so far."""
        for pool in self.pools:
            pool.fade(factor)

    def shifted(self, step: Vector) -> None:
        """Count the residuals from a point `step` further on."""
        for pool in self.pools:
            pool.shifted(step)

    def best(self, width: Vector) -> tuple[NormalEquations, Vector, int]:
        """Equations, the covariance of their gradient and the index of the size that leaves the least uncertainty.

        `width` scales the unknowns; one that is unsure by all of it counts as much as one without effect.
        """
        chosen: tuple[float, NormalEquations, Vector, int] | None = None
        for size, pool in enumerate(self.pools):
            equations = cross_equations(pool.gram())
            safe = SafeMatrix(equations, width)
            noise = pool.jackknife_noise(CHANNELS, safe) if self.are_many else pool.gradient_noise(CHANNELS)
            variance = np.diag(safe.covariance(noise, SafeMatrix.FLOOR)) / width**2
            total = float(np.minimum(variance, 1.0).sum())
            if chosen is None or total < chosen[0]:
                chosen = total, equations, noise, size
        assert chosen is not None
        return chosen[1:]

    @property
    def are_many(self) -> bool:
        """Whether there are enough of the largest tiles to go by the leverage of each."""
        return len(self.tiles[-1]) >= MANY

    def covariance(self, equations: NormalEquations, size: int, width: Vector) -> tuple[Vector, Vector]:
        """Covariance (k, k) of the solution of `equations`, those of size `size`, and of their gradient."""
        safe = SafeMatrix(equations, width)
        noise = self.pools[size].jackknife_noise(CHANNELS, safe)
        return safe.covariance(noise), noise

    def answer(self, change: Vector, equations: NormalEquations, size: int, width: Vector) -> Vector:
        """How far (k,) the solution of `equations`, those of size `size`, moves where pictures change by (p, 3)."""
        tiles = self.tiles[size]
        rows = tiles.weight * tiles.means(change[self.order[size]][..., None].astype(np.float32))[..., 0]
        gradient = self.pools[size].mean[:, 1:].T @ rows.ravel() / rows.size
        safe = SafeMatrix(equations, width)
        return -safe.inverse @ np.where(safe.blind, 0.0, gradient)

    def expected_error(self, equations: NormalEquations, noise: Vector, size: int, width: Vector) -> ExpectedError:
        """What `noise` in the gradient of `equations`, those of size `size`, leaves at their solution."""
        single = cross_equations(self.pools[0].gram())
        if single.cost <= 0.0 or min(np.diag(single.hessian).min(), np.diag(equations.hessian).min()) < 0.0:
            return ExpectedError(np.inf, np.inf, 0.0)
        safe, share = SafeMatrix(equations, width), np.sqrt(self.pools[size].own_share())
        total, own = (
            max(float(np.sum(single.hessian * safe.solution_covariance(part))), safe.expected_error(part))
            for part in (noise, noise * np.outer(share, share))
        )
        return ExpectedError(total, own, 2.0 * single.cost)
