# SPDX-License-Identifier: Apache-2.0
"""The difference of result and reference that noise does not explain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.colour import linear_from_srgb
from ...metrics.display.tone_mapping import View
from ...metrics.flip.block_means import block_sums
from ...metrics.pixels.neighbours import sums_around
from ...types.image import Encoding, Image, Pixels
from ...types.model_gap import ModelGap
from ...types.result import FitResult
from ..tolerances import CHANCE, DIM_FLOOR
from .fit_task import FitTask
from .region import blocks_around

GAP_BLOCK = 4  # pixels along each side of what is compared
LEAST_BLOCKS = 32  # fewer say too little
CONFIDENCE = 1.64  # standard deviations that 95 % of normal draws stay below


def model_gap(reference: Image, renders: tuple[Pixels, Pixels], mask: NDArray[np.bool_], view: View) -> ModelGap | None:
    """The gap between a reference and two renders of the result, scene-linear (height, width, 3), of independent noise.

    Every block is split like a chessboard: one half compares the first render with the reference, the other the second.
    The halves share what differs but no noise, so the mean product of their differences is the squared difference
    itself. Noise that is not independent from pixel to pixel, as after denoising, counts as a difference; so does
    anything else that is wider than a pixel. None if the target fills too few blocks.
    """
    near = blocks_around(mask, GAP_BLOCK)
    mask, target = mask[near], reference.pixels[near]
    first, second = (render[near] for render in renders)
    if reference.encoding is Encoding.SRGB:  # what a display cannot show is not known of the reference
        target = linear_from_srgb(target)
        first, second = view.light(first), view.light(second)
    weight = mask.astype(np.float64)[..., None]
    even = (np.indices(mask.shape).sum(axis=0) % 2 == 0)[..., None]
    full = block_sums(weight, GAP_BLOCK)[..., 0] == GAP_BLOCK * GAP_BLOCK
    if np.count_nonzero(full) < LEAST_BLOCKS:
        return None
    half = GAP_BLOCK * GAP_BLOCK / 2
    a, b = (
        block_sums((np.asarray(render, np.float64) - target) * weight * chosen, GAP_BLOCK)[full] / half
        for render, chosen in ((first, even), (second, ~even))
    )
    level = _around(
        block_sums(np.asarray(first, np.float64) + second, GAP_BLOCK).mean(axis=-1) / (2 * GAP_BLOCK**2), full
    )
    scale = np.maximum(level, 0.0) + DIM_FLOOR * max(float(level.mean()), 1e-12)
    squares = (a * b / scale**2).mean(axis=-1)
    square, sd = float(squares.mean()), float(squares.std()) / squares.size**0.5
    found = max(square, 0.0) ** 0.5 if square > CHANCE * sd else 0.0
    return ModelGap(found, max(square + CONFIDENCE * sd, 0.0) ** 0.5)


def with_gap(result: FitResult, task: FitTask, renders: tuple[Pixels, Pixels]) -> FitResult:
    """The result with its `model_gap`, and the sentence on it among its notes."""
    gap = model_gap(task.reference, renders, task.mask, task.view)
    said = (gap.sentence,) if gap is not None and gap.sentence else ()
    return replace(result, model_gap=gap, notes=(*result.notes, *said))


def _around(level: NDArray[np.float64], full: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Means over every full block and the full ones next to it, (blocks, 1).

    A block's own level is low where noise makes both differences negative, and such products would count more: few
    samples a pixel had a gap of 6 % where more had none.
    """
    return (sums_around(level * full, 1)[full] / sums_around(full.astype(np.float64), 1)[full])[:, None]
