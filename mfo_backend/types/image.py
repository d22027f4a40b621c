# SPDX-License-Identifier: Apache-2.0
"""A picture with its encoding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]
Pullback = Callable[[Pixels], NDArray[np.float64]]  # from dLoss/dPixels to dLoss/dVector


class Encoding(Enum):
    """What the numbers of an image mean: scene-linear Rec.709 radiance, or sRGB display values in [0, 1]."""

    LINEAR = "linear"
    SRGB = "srgb"


@dataclass(frozen=True)
class Image:
    """An RGB picture: `pixels` is float32 (height, width, 3); `alpha` is float32 (height, width) or None.

    `notes` are sentences on what was done to the numbers of its file, or not done, that a user should know. `counts`
    is True (height, width) where a reference shows what it should, None where all of it does.
    """

    pixels: Pixels
    encoding: Encoding
    alpha: Pixels | None = None
    notes: tuple[str, ...] = ()
    counts: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        if self.pixels.ndim != 3 or self.pixels.shape[2] != 3 or self.pixels.dtype != np.float32:
            raise ValueError(
                f"pixels are {self.pixels.dtype} {self.pixels.shape}; needed is float32 (height, width, 3)"
            )
        if self.alpha is not None and self.alpha.shape != self.pixels.shape[:2]:
            raise ValueError(f"alpha has shape {self.alpha.shape}; needed is {self.pixels.shape[:2]}")
        if self.counts is not None and self.counts.shape != self.pixels.shape[:2]:
            raise ValueError(f"counts has shape {self.counts.shape}; needed is {self.pixels.shape[:2]}")

    @property
    def height(self) -> int:
        return self.pixels.shape[0]

    @property
    def width(self) -> int:
        return self.pixels.shape[1]
