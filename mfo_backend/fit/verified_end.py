# SPDX-License-Identifier: Apache-2.0
"""Pictures of a fit's ends under random numbers that no stage has seen, with as many samples as they need."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..metrics.tone_mapping import View
from ..render.mitsuba_renderer import MitsubaRenderer
from ..render.renderer import Vector
from ..types.image import Encoding, Image, Pixels
from .stages import Candidate
from .verification import VERIFY_STREAM

FIRST_SAMPLES = 16  # a quarter of the noise (squares) of a reference of 4 samples a pixel
# Part of the squared difference from the reference that may be the picture's own noise; below, more samples would tell
# little. With 0.25 the root of the difference is at most 15 % too large.
NOISE_SHARE = 0.25
UNSEEN = 0.002  # of a display's white, half a step of 8 bits
PATHS_OF_A_PART = 1 << 18  # after twice as many, those of both halves, a request to stop is heard

_SECOND_HALF = 0x00A50000
_NEXT_SAMPLE = 0x9E3779B9  # as between the parts of one picture, so that none repeats another's numbers


@dataclass(frozen=True)
class VerifiedEnd(Candidate):
    """A vector with its picture, scene-linear, whose two halves have no random numbers in common.

    `samples` is the number of samples a pixel in each half.
    """

    halves: tuple[Pixels, Pixels] = field(repr=False)
    samples: int


class Verification:
    """Renders the ends of one fit; all of them see the same random numbers.

    Parameters
    ----------
    most
        Samples a pixel of a picture, at most. The first `FIRST_SAMPLES` often say enough: the start is usually far
        away, and under a noisy reference a picture without noise looks no nearer.
    view
        What a display shows: differences and noise are compared in its values, as every measure of a fit sees them
        compressed.
    """

    def __init__(
        self,
        renderer: MitsubaRenderer,
        reference: Image,
        mask: NDArray[np.bool_],
        view: View,
        *,
        seed: int,
        most: int,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._renderer, self._mask, self._view, self._should_stop = renderer, mask, view, should_stop
        self._seed, self._most = seed ^ VERIFY_STREAM, max(most // 2, 1)
        linear = reference.encoding is Encoding.LINEAR
        self._reference = view.display(np.maximum(reference.pixels, 0.0)) if linear else reference.pixels
        self._part = max(PATHS_OF_A_PART // mask.size, 1)

    def begin(self, vector: Vector) -> Callable[[], VerifiedEnd]:
        """Start the first samples of a picture; returns what waits for it."""
        samples = min(FIRST_SAMPLES // 2, self._most, self._part)
        halves = self._halves_later(vector, 0, samples)

        def wait() -> VerifiedEnd:
            first, second = (half() for half in halves)
            return VerifiedEnd(vector, 0.5 * (first + second), (first, second), samples)

        return wait

    def pictures(self, start: Callable[[], VerifiedEnd], ends: Sequence[Vector]) -> list[VerifiedEnd]:
        """The pictures of the start, which has begun, and of the fit's ends.

        The ends are near each other, so all of them have as many samples as the one that needs most.
        """
        found = [self.begin(end) for end in ends]
        return [*self._enough([start()]), *self._enough([end() for end in found])]

    def _enough(self, ends: list[VerifiedEnd]) -> list[VerifiedEnd]:
        while ends and ends[0].samples < self._most and not self._should_stop():
            if ends[0].samples >= FIRST_SAMPLES // 2 and not any(self.is_noisy(end) for end in ends):
                break
            ends = [self._grown(end) for end in ends]
        return ends

    def is_noisy(self, end: VerifiedEnd) -> bool:
        """Whether noise is more than `NOISE_SHARE` of what the picture and the reference differ by in the mask.

        Noise that most pixels do not show is none: under lights without extent only the silhouette has some.
        """
        first, second = (self._view.display(np.maximum(half[self._mask], 0.0)) for half in end.halves)
        noise = np.square(first - second) / 4.0  # of their mean
        if np.median(noise) < UNSEEN**2:
            return False
        difference = np.square(0.5 * (first + second) - self._reference[self._mask])
        return bool(noise.mean() > NOISE_SHARE * difference.mean())

    def _grown(self, end: VerifiedEnd) -> VerifiedEnd:
        """The picture with twice the samples, or one part more where they are many."""
        more = min(end.samples, self._most - end.samples, self._part)
        share = more / (end.samples + more)
        added = [half() for half in self._halves_later(end.vector, end.samples, more)]
        first, second = ((1.0 - share) * old + share * new for old, new in zip(end.halves, added, strict=True))
        return VerifiedEnd(end.vector, 0.5 * (first + second), (first, second), end.samples + more)

    def _halves_later(self, vector: Vector, after: int, samples: int) -> list[Callable[[], Pixels]]:
        """Start `samples` more samples a pixel of both halves; a whole picture counts as one pass."""
        passes = self._renderer.passes
        seeds = ((half + after * _NEXT_SAMPLE) % 2**32 for half in (self._seed, self._seed ^ _SECOND_HALF))
        halves = [self._renderer.image_later(vector, seed=seed, spp=samples) for seed in seeds]
        self._renderer.passes = passes + samples / self._most
        return halves
