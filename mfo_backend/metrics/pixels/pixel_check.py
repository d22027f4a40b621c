# SPDX-License-Identifier: Apache-2.0
"""Refuses pixels no metric is defined for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError

Array = NDArray[np.floating]


def check_finite(pixels: Array, what: str) -> None:
    """Raise `BadInputError` with the counts if `pixels` (height, width, 3) hold NaN or infinite values."""
    if np.isfinite(pixels).all():
        return
    nan = int(np.isnan(pixels).any(axis=-1).sum())
    infinite = int(np.isinf(pixels).any(axis=-1).sum())
    raise BadInputError(
        f"{what} has {nan} pixels with NaN and {infinite} with infinite values of {pixels.shape[0] * pixels.shape[1]}: "
        "only finite values can be compared, so render or export it again without them."
    )


def check_size(pixels: Array, shape: tuple[int, ...], what: str) -> None:
    """Raise `BadInputError` unless `pixels` have the reference's `shape` (height, width, 3)."""
    if pixels.shape != shape:
        raise BadInputError(
            f"{what} is {_size(pixels.shape)} but the reference is {_size(shape)}: "
            "both must have the same size, so render one of them again."
        )


def check_pair(reference: Array, test: Array) -> None:
    """Raise `BadInputError` unless both images are finite and of one size."""
    check_size(test, reference.shape, "The test image")
    check_finite(reference, "The reference")
    check_finite(test, "The test image")


def check_image(image: Array, shape: tuple[int, ...]) -> None:
    """Raise `BadInputError` unless a rendered image is finite and of `shape`, so that no optimiser meets a NaN."""
    check_size(image, shape, "The rendered image")
    check_finite(image, "The rendered image")


def check_mask(mask: NDArray[np.bool_], shape: tuple[int, ...]) -> None:
    """Raise `BadInputError` unless `mask` has the reference's (height, width) and holds a pixel."""
    if mask.shape != shape:
        raise BadInputError(f"The mask has shape {mask.shape}: it must be {shape}, as the reference.")
    if not mask.any():
        raise BadInputError("The mask is empty: it must hold at least one pixel of the object.")


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]}x{shape[0]}" if len(shape) == 3 and shape[2] == 3 else f"an array of shape {shape}"
