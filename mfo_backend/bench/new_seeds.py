# SPDX-License-Identifier: Apache-2.0
"""A renderer that ignores the seed it is given: what common random numbers are worth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..render.renderer import Pullback, Renderer, Vector
from ..types.image import Pixels


class NewSeeds:
    """The `Renderer` protocol with other random numbers in every picture."""

    def __init__(self, renderer: Renderer, seed: int) -> None:
        self._renderer = renderer
        self._seeds = np.random.default_rng(seed)
        self.model, self.table, self.start = renderer.model, renderer.table, renderer.start

    @property
    def passes(self) -> float:
        """See `Renderer.passes`."""
        return self._renderer.passes

    @passes.setter
    def passes(self, value: float) -> None:
        self._renderer.passes = value

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer.image`."""
        return self._renderer.image(vector, seed=self._next(), spp=spp)

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`."""
        return self._renderer.image_and_pullback(vector, seed=self._next(), spp=spp)

    def target_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.target_mask`."""
        return self._renderer.target_mask()

    def _next(self) -> int:
        return int(self._seeds.integers(2**31))
