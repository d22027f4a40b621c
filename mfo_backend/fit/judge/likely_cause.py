# SPDX-License-Identifier: Apache-2.0
"""What most likely keeps a result from its reference, by where the two pictures differ."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...render.camera.widened_mask import widened
from ...types.verdict import Cause

MOST_SHIFT = 5  # pixels that a picture is tried to be moved by, along each axis
# Part of the squared difference that a moved picture takes away, from which on its place is the reason
EXPLAINED = 0.5
SMOOTH = 1.0  # pixels: noise would hide what a shift takes away
BESIDE = 6  # pixels around the target that a shift is looked for in
RIM = 2  # pixels inside of the silhouette that belong to it
# Part of the squared difference at the silhouette, and how much more than the silhouette's part of the area
AT_RIM, MORE_THAN_AREA = 0.6, 2.0
UNLIKE = 0.35  # correlation of two pictures' luminance below which they hardly show the same
DIFFERS, MOSTLY = 0.03, 0.5  # display values; part of the surroundings

Shown = NDArray[np.floating]
Mask = NDArray[np.bool_]


def likely_cause(
    reference: Shown, result: Shown, mask: Mask, around: tuple[Shown, Shown, Mask] | None, *, noted: bool
) -> Cause:
    """The likeliest cause of a difference that noise does not explain.

    Parameters
    ----------
    reference, result
        Display values (height, width, 3).
    around
        Means of both over blocks, and which of these show no part of the target; None unless they differ there.
    noted
        Whether the export named something that it has left out.
    """
    if _is_moved(reference, result, mask):
        return Cause.CAMERA_OR_SHAPE
    if around is not None and _mostly_differs(*around):
        return Cause.PICTURE if _correlation(*around) < UNLIKE else Cause.LIGHT
    if _is_at_rim(reference, result, mask):
        return Cause.CAMERA_OR_SHAPE
    if around is not None:
        return Cause.SURROUNDINGS
    return Cause.NOTED if noted else Cause.MATERIAL


def _mostly_differs(first: Shown, second: Shown, outside: Mask) -> bool:
    return bool((np.abs(first - second)[outside].mean(axis=-1) > DIFFERS).mean() > MOSTLY)


def _correlation(first: Shown, second: Shown, chosen: Mask) -> float:
    a, b = (picture[chosen].mean(axis=-1) for picture in (first, second))
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0.0 else 1.0


def _is_moved(reference: Shown, result: Shown, mask: Mask) -> bool:
    """Whether the result fits the reference much better some pixels away, at the target and beside it."""
    from scipy.ndimage import gaussian_filter

    first, second = (gaussian_filter(p.mean(axis=-1, dtype=np.float64), SMOOTH) for p in (reference, result))
    near = widened(mask, BESIDE)
    edge = MOST_SHIFT  # what is moved in from outside of the picture is not known
    height, width = mask.shape
    inside = (slice(edge, height - edge), slice(edge, width - edge))
    if not near[inside].any():
        return False
    chosen = near[inside]

    def apart(down: int, right: int) -> float:
        moved = second[edge + down : height - edge + down, edge + right : width - edge + right]
        return float(np.square(first[inside] - moved)[chosen].mean())

    shifts = product(range(-MOST_SHIFT, MOST_SHIFT + 1), repeat=2)
    return min(apart(*shift) for shift in shifts) < (1.0 - EXPLAINED) * apart(0, 0)


def _is_at_rim(reference: Shown, result: Shown, mask: Mask) -> bool:
    """Whether most of the difference is at the target's silhouette."""
    rim = mask & widened(~mask, RIM)
    squares = np.square(reference - result).mean(axis=-1) * mask
    share = float(squares[rim].sum()) / max(float(squares.sum()), 1e-12)
    return share > max(AT_RIM, MORE_THAN_AREA * np.count_nonzero(rim) / max(np.count_nonzero(mask), 1))
