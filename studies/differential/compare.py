# SPDX-License-Identifier: Apache-2.0
"""Whether two pictures with noise differ, in level or somewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEVEL = 0.02  # of the mean of the whole picture
DEVIATIONS = 4.0  # of a block of 8 x 8 pixels
BLOCK = 8  # pixels along each side
# Of the picture's mean: a smaller difference of a block is none. Noise that is estimated from two halves is
# underestimated where a few bright samples are still missing.
FLOOR = 0.02

Picture = NDArray[np.float64]


@dataclass(frozen=True)
class Difference:
    """Ours minus Cycles: of the whole picture in parts of its mean, and of the worst block in deviations."""

    level: float
    level_deviations: float
    block_deviations: float

    @property
    def is_failure(self) -> bool:
        """Whether it is more than noise, and more than anybody would accept in silence."""
        level = abs(self.level) > LEVEL and self.level_deviations > DEVIATIONS
        return level or self.block_deviations > DEVIATIONS


def compare(ours: tuple[Picture, Picture], cycles: tuple[Picture, Picture]) -> Difference:
    """Compare two pictures (height, width, 3), each as two independent halves."""
    difference = 0.5 * (ours[0] + ours[1]) - 0.5 * (cycles[0] + cycles[1])
    variance = 0.25 * ((ours[0] - ours[1]) ** 2 + (cycles[0] - cycles[1]) ** 2)  # of the means of the halves
    scale = max(float(np.mean(cycles)), 1e-6)
    count = difference.size
    level_deviation = float(np.sqrt(variance.sum())) / count / scale
    level = float(difference.mean()) / scale
    block, noise = _means(difference), np.sqrt(_means(variance) / BLOCK**2)
    # channels share their noise: a block counts by the mean of its channels
    block, noise = np.abs(block.mean(axis=-1)), noise.mean(axis=-1)
    over = np.where(block > FLOOR * scale, block / np.maximum(noise, FLOOR * scale / DEVIATIONS), 0.0)
    return Difference(level, abs(level) / max(level_deviation, 1e-6), float(over.max(initial=0.0)))


def _means(picture: Picture) -> Picture:
    rows, columns = picture.shape[0] // BLOCK, picture.shape[1] // BLOCK
    whole = picture[: rows * BLOCK, : columns * BLOCK]
    return whole.reshape(rows, BLOCK, columns, BLOCK, -1).mean(axis=(1, 3))
