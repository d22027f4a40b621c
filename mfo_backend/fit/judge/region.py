# SPDX-License-Identifier: Apache-2.0
"""The part of a picture that a fit looks at, and losses that look at it alone, whatever lies behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...metrics.losses.loss import Loss
from ...types.image import Encoding, Image, Pixels


def fill_outside(
    reference: Image, background: Pixels, mask: NDArray[np.bool_], display: Callable[[Pixels], Pixels]
) -> Image:
    """The reference with `background` (scene-linear) wherever `mask` is False, in the reference's own encoding.

    A background that differs between reference and render, or its noise, would add a constant to every loss and hide
    small gains. `display` turns linear values into display values.
    """
    shown = display(background) if reference.encoding is Encoding.SRGB else background
    return replace(reference, pixels=np.where(mask[..., None], reference.pixels, shown).astype(np.float32))


def blocks_around(mask: NDArray[np.bool_], side: int, margin: int = 0) -> tuple[slice, slice]:
    """Rows and columns of the least rectangle of blocks around the pixels of `mask`, and `margin` pixels on each side.

    Blocks of `side` pixels lie as in the whole picture; the last one may reach beyond it.
    """
    rows, columns = (np.flatnonzero(mask.any(axis=1 - axis)) for axis in (0, 1))
    return _span(rows, side, margin), _span(columns, side, margin)


def _span(lines: NDArray[np.int64], side: int, margin: int) -> slice:
    first, last = max(int(lines[0]) - margin, 0), int(lines[-1]) + 1 + margin
    return slice(first // side * side, -(-last // side) * side)


class MaskedLoss:
    """A loss of pictures whose pixels outside `mask` are held at `background`."""

    def __init__(self, loss: Loss, background: Pixels, mask: NDArray[np.bool_]) -> None:
        self.name: str = loss.name
        self._loss = loss
        self._background = background
        self._mask = mask[..., None]

    def value(self, image: Pixels) -> float:
        """The loss of a scene-linear image."""
        return self._loss.value(np.where(self._mask, image, self._background))

    def value_and_gradient(self, image: Pixels) -> tuple[float, Pixels]:
        """The loss and its gradient, which is 0 outside the mask."""
        value, gradient = self._loss.value_and_gradient(np.where(self._mask, image, self._background))
        return value, np.where(self._mask, gradient, np.float32(0.0))
