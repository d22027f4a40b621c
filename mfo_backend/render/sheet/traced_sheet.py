# SPDX-License-Identifier: Apache-2.0
"""Whole light paths of several scenes as those of one contact sheet."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..traced.traced_paths import TracedPaths
from .sheet_renderer import SheetRenderer, seed_of


class TracedSheet:
    """What `TracedPaths` is for one picture, for all pictures of a sheet; what lies between them is black.

    Raises
    ------
    UnrecordableError
        As `TracedPaths`.
    """

    def __init__(self, renderer: SheetRenderer) -> None:
        self.table = renderer.table
        self._sheet = renderer.sheet
        self._scenes = [TracedPaths(each) for each in renderer.renderers]

    def roughness(self, vector: NDArray[np.float64]) -> float:
        """See `TracedPaths.roughness`."""
        return self._scenes[0].roughness(vector)

    def images(
        self,
        vectors: NDArray[np.float64],
        pixels: NDArray[np.int64],
        *,
        seed: int,
        samples: int,
        jacobian: bool,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> NDArray[np.float32]:
        """See `TracedPaths.images`, for flat indices of the sheet."""
        vectors = np.atleast_2d(vectors)
        columns = 1 + self.table.length if jacobian else 1
        found = np.zeros((len(vectors), len(pixels), 3, columns), np.float32)
        for number, chosen, own in self._sheet.parted(pixels):
            images = self._scenes[number].images(
                vectors, own, seed=seed_of(seed, number), samples=samples, jacobian=jacobian, should_stop=should_stop
            )
            found[:, chosen] = images * np.float32(self._sheet.gains[number])
        return found
