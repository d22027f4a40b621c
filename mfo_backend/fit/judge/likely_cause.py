# SPDX-License-Identifier: Apache-2.0
"""What most likely keeps a result from its reference, by where the two pictures differ."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...render.camera.widened_mask import widened
from ...types.verdict import Cause
from ..tolerances import CHANCE

MOST_SHIFT = 5  # pixels that a picture is tried to be moved by, along each axis
# Part of the squared difference that a moved picture takes away, from which on its place is the reason
EXPLAINED = 0.5
SMOOTH = 1.0  # pixels: noise would hide what a shift takes away
SHIFTED_WITHIN = 6  # pixels around the target that a shift is looked for in
RIM = 2  # pixels inside of the silhouette that belong to it
# Part of the squared difference at the silhouette, and how much more than the silhouette's part of the area
AT_RIM, MORE_THAN_AREA = 0.6, 2.0
# Pixels on both sides of the silhouette whose gradients are asked whether the reference has the object's outline; and
# their correlation and slope (1 for the same picture) below which it has not. Correlations of four other pictures are
# 0.05 to 0.29, of 27 others 0.47 and more but for a moved lamp (0.25) and a turned probe (0.04)
# (docs/notebook/verdicts.md). Larger: a moved lamp is another scene. Smaller: another object is taken for a light.
OUTLINE, NO_OUTLINE = 3, 0.35
DIFFERS, MOSTLY = 0.03, 0.5  # display values; part of the surroundings
# Part of the target that differs from which on it is lit otherwise, where surroundings differ, too: a material makes up
# for little of a light from elsewhere, and misses little of what is beside it. Turned lamps and probes 0.52 and more of
# six, missing objects 0.06 at most of three (docs/notebook/verdicts.md).
ON_TARGET = 0.3

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
    explained, is_away = _best_shift(reference, result, mask)
    if explained > EXPLAINED:
        return Cause.CAMERA_OR_SHAPE
    if around is not None and not _has_outline(reference, result, mask):
        return Cause.PICTURE
    on_target = _differing(_calm(reference)[..., None], _calm(result)[..., None], mask)
    if around is not None and (_differing(*around) > MOSTLY or on_target > ON_TARGET):
        return Cause.LIGHT
    # what stands before the object or throws a shadow on it is at its silhouette, too, and moves nothing
    if _is_at_rim(reference, result, mask) and (around is None or is_away):
        return Cause.CAMERA_OR_SHAPE
    if around is not None:
        return Cause.SURROUNDINGS
    return Cause.NOTED if noted else Cause.MATERIAL


def _differing(first: Shown, second: Shown, chosen: Mask) -> float:
    """Part of what is chosen where two pictures (height, width, channels) differ."""
    return float((np.abs(first - second)[chosen].mean(axis=-1) > DIFFERS).mean())


def _has_outline(reference: Shown, result: Shown, mask: Mask) -> bool:
    """Whether the reference changes across the silhouette as the result does.

    Noise of the reference lowers a correlation and not the slope, and other contrast the slope alone: where the object
    is missing both are near 0.
    """
    band = widened(mask, OUTLINE) & widened(~mask, OUTLINE)
    (down, right), own = (np.gradient(picture)[:2] for picture in (_calm(reference), _calm(result)))
    products = (down * own[0] + right * own[1])[band]
    together = abs(float(products.sum()))  # light from another side changes the sign
    squares = float((own[0] ** 2 + own[1] ** 2)[band].sum())
    if squares == 0.0:
        return True
    correlation = together / np.sqrt(max(float((down**2 + right**2)[band].sum()), 1e-30) * squares)
    slope = (together + CHANCE * np.sqrt(np.square(products).sum())) / squares
    return bool(max(correlation, slope) >= NO_OUTLINE)


def _best_shift(reference: Shown, result: Shown, mask: Mask) -> tuple[float, bool]:
    """What part of the squared difference goes where the result is best moved over the reference, and whether it is.

    At the target and beside it, by some pixels.
    """
    first, second = _calm(reference), _calm(result)
    near = widened(mask, SHIFTED_WITHIN)
    edge = MOST_SHIFT  # what is moved in from outside of the picture is not known
    height, width = mask.shape
    inside = (slice(edge, height - edge), slice(edge, width - edge))
    chosen = near[inside]
    if not chosen.any():
        return 0.0, False

    def apart(down: int, right: int) -> float:
        moved = second[edge + down : height - edge + down, edge + right : width - edge + right]
        return float(np.square(first[inside] - moved)[chosen].mean())

    best = min(product(range(-MOST_SHIFT, MOST_SHIFT + 1), repeat=2), key=lambda shift: apart(*shift))
    return 1.0 - apart(*best) / max(apart(0, 0), 1e-30), best != (0, 0)


def _calm(picture: Shown) -> NDArray[np.float64]:
    """The mean of the channels without the finest noise, (height, width)."""
    from scipy.ndimage import gaussian_filter

    return gaussian_filter(picture.mean(axis=-1, dtype=np.float64), SMOOTH)


def _is_at_rim(reference: Shown, result: Shown, mask: Mask) -> bool:
    """Whether most of the difference is at the target's silhouette."""
    rim = mask & widened(~mask, RIM)
    squares = np.square(reference - result).mean(axis=-1) * mask
    share = float(squares[rim].sum()) / max(float(squares.sum()), 1e-12)
    return share > max(AT_RIM, MORE_THAN_AREA * np.count_nonzero(rim) / max(np.count_nonzero(mask), 1))
