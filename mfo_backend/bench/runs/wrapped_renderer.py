# SPDX-License-Identifier: Apache-2.0
"""Renderers around a renderer: one with other random numbers, one that notes where a fit has been."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...render.pictures.renderer import Pullback, Renderer, Vector
from ...types.image import Pixels


class WrappedRenderer:
    """The `Renderer` protocol, handed on."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self.model, self.table, self.start = renderer.model, renderer.table, renderer.start
        self.counter = renderer.counter

    @property
    def passes(self) -> float:
        """See `Renderer.passes`."""
        return self.counter.count

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer.image`."""
        return self._renderer.image(vector, seed=seed, spp=spp)

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`."""
        return self._renderer.image_and_pullback(vector, seed=seed, spp=spp)

    def target_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.target_mask`."""
        return self._renderer.target_mask()

    def otherwise_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.otherwise_mask`."""
        return self._renderer.otherwise_mask()


class NewSeeds(WrappedRenderer):
    """Ignores the seed it is given: what common random numbers are worth."""

    def __init__(self, renderer: Renderer, seed: int) -> None:
        super().__init__(renderer)
        self._seeds = np.random.default_rng(seed)

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer.image`."""
        return super().image(vector, seed=self._next(), spp=spp)

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`."""
        return super().image_and_pullback(vector, seed=self._next(), spp=spp)

    def _next(self) -> int:
        return int(self._seeds.integers(2**31))


class Watched(WrappedRenderer):
    """Notes every vector a fit steps from, in `visited`."""

    def __init__(self, renderer: Renderer) -> None:
        super().__init__(renderer)
        self.visited: list[Vector] = []

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`."""
        self.visited.append(np.array(vector))
        return super().image_and_pullback(vector, seed=seed, spp=spp)
