# SPDX-License-Identifier: Apache-2.0
"""Whether a fit's result looks like its reference, and what keeps it from it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.colour import linear_from_srgb
from ...metrics.display.tone_mapping import DisplayView, View
from ...metrics.flip.block_means import block_side, block_sums
from ...render.camera.widened_mask import widened
from ...types.image import Encoding, Image, Pixels
from ...types.result import PictureResult
from ...types.verdict import Cause, Difference, Judgement, Verdict, worst
from .beyond_noise import BLURRED_TOGETHER, FEW_PIXELS, NEXT, beyond_noise, displayed, mean_flip
from .likely_cause import likely_cause

# Measured on Cycles scenes by `studies.verdicts` (docs/user/verdicts.md): with nothing planted at most 0.019, 0.005 and
# 0.025; a result more than 0.05 of FLIP above the noise is above one of them.
SAME_VISIBLE, SAME_SHARED = 0.025, 0.01
SAME_FINE = 0.035
DIFFERENT_VISIBLE, DIFFERENT_SHARED = 0.1, 0.05
# Of what surrounds the target: nothing there is fitted, and it is exported less exactly than the target
AROUND_SHARED = 0.03
AROUND_BLOCKS = 32  # along the longer side: the surroundings are rendered with few samples
BESIDE = 3  # pixels next to the target that are not its surroundings
PLAIN = 0.004  # deviation of display values: so even a background was cut out, not rendered
BRIGHTEST = 4.0  # times a display's white: fireflies count as if they were so bright
# FLIP of a difference that a verdict should not miss; a vase 0.053 above the noise was called the same, and a lamp's
# base of 111 pixels 0.083 (docs/notebook/several_materials.md, verdicts.md). Larger: less is said to hide, and more
# noise may be the same. Smaller: all small targets get the sentence, and fewer of them a tick.
HIDDEN = 0.05
WORSE = 0.01  # FLIP more than that of the start from which on a result is worse

Mask = NDArray[np.bool_]


def judge(
    reference: Image, result: Pixels, mask: Mask, view: View, *, noted: bool = False, others: Mask | None = None
) -> Judgement | None:
    """The verdict on a result's scene-linear picture (height, width, 3) where `mask` sees the target.

    `view` is what a display reference was made with; `noted` whether the export has left something out. What is fitted
    in `others` is not among the surroundings. None if the target fills too few pixels to say.
    """
    side = block_side(mask)
    target = _light_means(reference, result, view, mask, side)
    inside = _inside(mask, side)
    difference = beyond_noise(*target, inside)
    if difference is None:
        return None
    blocks = math.ceil(max(mask.shape) / AROUND_BLOCKS)
    surroundings = _light_means(reference, result, view, mask, blocks)
    near = widened(mask if others is None else mask | others, BESIDE)
    if reference.counts is not None:
        near = near | ~reference.counts
    outside = block_sums(near[..., None].astype(np.float64), blocks)[..., 0] == 0.0
    around = None if _is_cut_out(reference, near) else beyond_noise(*surroundings, outside, NEXT)
    differs = around is not None and around.shared_at_least > AROUND_SHARED
    verdict = _verdict(difference)
    if verdict is Verdict.SAME and differs:
        verdict = Verdict.CLOSE
    shown, result_shown = map(displayed, target)
    pixels = np.count_nonzero(inside)
    # the mean of noise over few independent pixels is as large as what should not be missed
    if verdict is Verdict.SAME and difference.noise > HIDDEN * math.sqrt(pixels / BLURRED_TOGETHER):
        return Judgement(Verdict.CLOSE, Cause.NOISE, difference, around)
    if verdict is Verdict.SAME:
        few = pixels < FEW_PIXELS
        # pixel by pixel, noise included: no difference of the pictures is larger
        hides = few and mean_flip(shown, result_shown, inside) > HIDDEN
        return Judgement(verdict, None, difference, around, may_hide=hides)
    first, second = map(displayed, surroundings)
    cause = likely_cause(shown, result_shown, inside, (first, second, outside) if differs else None, noted=noted)
    return Judgement(verdict, cause, difference, around)


def worst_judgement(pictures: tuple[PictureResult, ...]) -> Judgement | None:
    """The verdict on all pictures: the worst one, with the name of its picture; None where there is none."""
    found = worst(picture.judgement for picture in pictures)
    if found is None or found.verdict is Verdict.SAME:
        hiding = any(p.judgement is not None and p.judgement.may_hide for p in pictures)
        return found if found is None else replace(found, may_hide=hiding)
    return replace(found, picture=next(picture.label for picture in pictures if picture.judgement is found))


def difference_of(reference: Image, picture: Pixels, mask: Mask, view: View) -> Difference | None:
    """How far a scene-linear picture (height, width, 3) is from the reference; None for few pixels of the `mask`."""
    side = block_side(mask)
    return beyond_noise(*_light_means(reference, picture, view, mask, side), _inside(mask, side))


def is_worse(reference: Image, start: Pixels, result: Difference | None, mask: Mask, view: View) -> bool:
    """Whether a `result` that is so far from the reference is visibly farther than the start's picture."""
    if result is None or result.visible <= WORSE:  # nothing is nearer than that
        return False
    before = difference_of(reference, start, mask, view)
    return before is not None and result.visible > before.visible + WORSE


def _inside(mask: Mask, side: int) -> Mask:
    """Blocks of `side` pixels that are mostly in the mask."""
    return block_sums(mask[..., None].astype(np.float64), side)[..., 0] > 0.5 * side**2


def _verdict(difference: Difference) -> Verdict:
    visible, shared = difference.visible, difference.shared_at_least
    if visible <= SAME_VISIBLE and shared <= SAME_SHARED and difference.fine_at_least <= SAME_FINE:
        return Verdict.SAME
    if visible > DIFFERENT_VISIBLE or shared > DIFFERENT_SHARED:
        return Verdict.DIFFERENT
    return Verdict.CLOSE


def _light_means(
    reference: Image, result: Pixels, view: View, mask: Mask, side: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both pictures in light, 1 being a display's white, as means over blocks; radiance is averaged before a view."""
    if reference.encoding is Encoding.LINEAR:
        scale = np.float32(2.0 ** DisplayView.for_scene(reference.pixels, mask).exposure_ev)
        first, second = (np.clip(p * scale, 0.0, BRIGHTEST) for p in (reference.pixels, result))
        return _means(first, side), _means(second, side)
    means = _means(np.maximum(result, 0.0), side).astype(np.float32)
    return _means(linear_from_srgb(reference.pixels), side), np.asarray(view.light(means), np.float64)


def _means(pixels: Pixels, side: int) -> NDArray[np.float64]:
    return block_sums(pixels.astype(np.float64), side) / side**2


def _is_cut_out(reference: Image, near: Mask) -> bool:
    """Whether the reference shows one even colour around the target, or nothing does."""
    outside = ~near if reference.alpha is None else ~near & (reference.alpha > 0.5)
    return not outside.any() or bool(np.all(reference.pixels[outside].std(axis=0) < PLAIN))
