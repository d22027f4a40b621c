# SPDX-License-Identifier: Apache-2.0
"""The last stage of a fit on traced paths: FLIP, where the best squares leave more of a difference than noise is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..metrics.tone_mapping import View
from ..types.image import Image, Pixels
from .course import Course
from .flip_stage import minimise_flip
from .model_gap import model_gap
from .picture_judge import PictureJudge
from .traced_tiles import TracedTiles

FLIP = "flip"
STREAM = 0x6F000000  # random numbers of no other stage
WORTH = 0.02  # relative difference of blocks of pixels that noise does not explain; less is hard to see
MOST_PIXELS = 1 << 16  # FLIP needs whole pictures; of more pixels one takes too long
HALF_PATHS = 1 << 19  # of a half of a picture; with fewer, noise decides some results (docs/glass.md)
HALF_SAMPLES = (4, 32)  # of a pixel, at least and at most
REACH = 0.1  # of the range: as far as one linear picture is trusted
ROUNDS = 2  # linear pictures; a third changed nothing
STILL = 0.01  # of the range: a shorter way needs no other picture

Vector = NDArray[np.float64]


def lower_traced_flip(
    pictures: TracedTiles,
    judge: PictureJudge,
    reference: Image,
    view: View,
    start: Vector,
    kept: NDArray[np.bool_],
    course: Course,
    seed: int,
) -> list[Vector]:
    """The point of lower FLIP by `judge`, seen from `start`, with the values of `kept` as they are.

    There is none where nothing was better, where the picture at `start` differs from the reference by less than noise
    explains or an eye sees, where the reference is compared at equal counts (its noise is all there is to see) and for
    too large a target.

    Noise is no part of the search: a picture and its derivatives are traced once, many paths a pixel, and FLIP is
    minimised over the linear picture y + J (x - start) within `REACH`; then once more from there. The search is in
    units of that small box and ends early: one in units of the whole range follows the reference's noise further
    (docs/glass.md).
    """
    mask, table = pictures.mask, pictures.paths.table
    pixels = np.flatnonzero(mask)
    if pictures.counts is not None or len(pixels) > MOST_PIXELS:
        return []
    samples = int(np.clip(HALF_PATHS // len(pixels), *HALF_SAMPLES))
    width = table.upper - table.lower

    def traced(x: Vector, turn: int) -> list[NDArray[np.float32]]:
        table = pictures.tables(pixels, x[None], (seed ^ STREAM) + turn, samples, jacobian=turn > 0)
        return np.split(table[0], 2)

    def whole(rows: NDArray[np.floating]) -> Pixels:
        image = pictures.reference.copy()
        image[mask] = rows
        return image

    halves = [whole(half[..., 0]) for half in traced(start, 0)]
    if course.should_stop():
        return []
    gap = model_gap(reference, (halves[0], halves[1]), mask, view)
    if gap is None or gap.relative < WORTH:
        return []
    with course.stage(FLIP) as stage:
        x = stage.vector = start
        reach = np.where(kept, 0.0, REACH * width)
        for turn in range(1, 1 + ROUNDS):
            rows = np.mean(traced(x, turn), axis=0)
            if course.should_stop():
                break
            new, _ = minimise_flip(
                judge,
                _LinearPicture(rows, x, whole, mask),
                x,
                np.maximum(table.lower, x - reach),
                np.minimum(table.upper, x + reach),
                on_value=course.values(stage),
                should_stop=course.should_stop,
            )
            moved = float(np.max(np.abs(new - x) / width))
            x = stage.vector = new
            if moved < STILL:
                break
    return [] if np.array_equal(x, start) else [x]


class _LinearPicture:
    """The picture y + J (x - at) of rows (p, 3, 1 + k), with its pullback."""

    def __init__(
        self,
        rows: NDArray[np.float32],
        at: Vector,
        whole: Callable[[NDArray[np.floating]], Pixels],
        mask: NDArray[np.bool_],
    ) -> None:
        self._image, self._jacobian = rows[..., 0], rows[..., 1:]
        self._at, self._whole, self._mask = at, whole, mask

    def __call__(self, x: Vector) -> tuple[Pixels, Callable[[Pixels], Vector]]:
        image = self._image + self._jacobian @ (x - self._at).astype(np.float32)
        return self._whole(image), lambda gradient: np.einsum(
            "pc,pck->k", gradient[self._mask], self._jacobian, dtype=np.float64
        )
