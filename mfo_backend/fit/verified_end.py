# SPDX-License-Identifier: Apache-2.0
"""Pictures of a fit's ends under random numbers that no stage has seen, with as many samples as they need."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..metrics.tone_mapping import View
from ..render.mitsuba_renderer import MitsubaRenderer
from ..render.renderer import Vector
from ..render.widened_mask import widened
from ..types.image import Encoding, Image, Pixels
from .stages import Candidate
from .verification import VERIFY_STREAM

FIRST_SAMPLES = 16  # a quarter of the noise (squares) of a reference of 4 samples a pixel
START_SAMPLES = 4  # of the start, which is mostly far away: a part that has more counts, too
FIRST_SAMPLES_EXACT = 8  # where every light is exact: for silhouettes and light over other surfaces
# Part of the squared difference from the reference that may be the picture's own noise; below, more samples would tell
# little. With 0.25 the root of the difference is at most 15 % too large.
NOISE_SHARE = 0.25
MOST_EVEN = 4  # samples of a part, stratified in each pixel; more would need another kernel and change little
UNSEEN = 0.002  # of a display's white, half a step of 8 bits
# Paths of one picture: of a whole one, most of which may be background, and further ones where it is looked at. About
# one second and three on two processors; a picture of 256 x 256 stays below both
MOST_WHOLE, MOST_FURTHER = 1 << 21, 1 << 23
# Pixels: noise outside of them adds 0.0008 to the FLIP of a disc of 60 pixels, noise next to the disc 0.012
BLURRED = 4
PATHS_OF_A_PART = 1 << 19  # after twice as many, those of both halves, a request to stop is heard

_SECOND_HALF = 0x00A50000
_NEXT_SAMPLE = 0x9E3779B9  # as between the parts of one picture, so that none repeats another's numbers


@dataclass(frozen=True)
class VerifiedEnd(Candidate):
    """A vector with its picture, scene-linear, whose two halves have no random numbers in common."""

    halves: tuple[Pixels, Pixels] = field(repr=False)


@dataclass
class GrowingPicture:
    """Two halves of a picture of a vector, and the samples that each of them has in a pixel that is looked at."""

    vector: Vector
    halves: list[Pixels]
    samples: int

    def add(self, pixels: NDArray[np.int64], halves: Sequence[NDArray[np.float32]], samples: int) -> None:
        """Take in further samples, as many of each half, of some pixels by their flat indices."""
        share = np.float32(samples / (self.samples + samples))
        for half, more in zip(self.halves, halves, strict=True):
            flat = half.reshape(-1, 3)
            flat[pixels] += share * (more - flat[pixels])
        self.samples += samples

    def end(self) -> VerifiedEnd:
        """The picture as it is now."""
        first, second = self.halves
        return VerifiedEnd(self.vector, 0.5 * (first + second), (first, second))


class Verification:
    """Renders the ends of one fit; all of them see the same random numbers.

    A picture begins whole and goes on where it is looked at: where `mask` is True, and next to that.

    Parameters
    ----------
    first, most
        Samples a pixel of an end's picture, at least and at most. The first often say enough: under a noisy reference a
        picture without noise looks no nearer.
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
        first: int = FIRST_SAMPLES,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._renderer, self._mask, self._view, self._should_stop = renderer, mask, view, should_stop
        linear = reference.encoding is Encoding.LINEAR
        masked = reference.pixels[mask]
        self._reference = view.display(np.maximum(masked, 0.0)) if linear else masked
        self._seed = seed ^ VERIFY_STREAM
        self._whole, self._looked_at = np.arange(mask.size), np.flatnonzero(widened(mask, BLURRED))
        # of one half, as all counts of samples from here on
        self._most = max(most // 2, 1)
        self._first = min(first // 2, self._most)
        self._begun = _power(min(MOST_WHOLE // (2 * mask.size), self._first, MOST_EVEN))
        most_here = self._begun + MOST_FURTHER // (2 * len(self._looked_at))
        self._most_here = self._most if self._most <= most_here else _power(most_here)

    def begin(self, vector: Vector) -> Callable[[], GrowingPicture]:
        """Start the first samples of a picture; returns what waits for it."""
        shape = (*self._mask.shape, 3)
        later = self._halves_later(vector, self._whole, 0, self._begun)
        return lambda: GrowingPicture(vector, [half.reshape(shape) for half in later()], self._begun)

    def pictures(self, start: Callable[[], GrowingPicture], ends: Sequence[Vector]) -> list[VerifiedEnd]:
        """The pictures of the start, which has begun, and of the fit's ends.

        The ends are near each other, so all of them have as many samples as the one that needs most.
        """
        begun = [self.begin(end) for end in ends]
        first, last = [start()], [end() for end in begun]
        self._grow(first, min(START_SAMPLES // 2, self._first))
        self._grow(last, self._first)
        return [picture.end() for picture in (*first, *last)]

    def _grow(self, pictures: list[GrowingPicture], wanted: int) -> None:
        """Double the samples of all pictures, at least `wanted`, until they say enough."""
        while pictures:
            self._add(pictures, min(wanted, self._most_here))
            if pictures[0].samples < min(wanted, self._most_here):
                return  # as was requested
            if wanted >= self._most_here or not any(self._is_noisy(*picture.halves) for picture in pictures):
                return
            wanted *= 2

    def _add(self, pictures: list[GrowingPicture], wanted: int) -> None:
        """Render parts until all pictures have so many samples; the next one is traced while one is computed."""
        begun: deque[Callable[[], None]] = deque()
        ahead = 1 if len(self._looked_at) <= PATHS_OF_A_PART else 0  # two parts of a huge picture are twice the memory
        after = pictures[0].samples
        while after < wanted and not self._should_stop():
            samples = self._samples_of_a_part(wanted - after)
            for picture in pictures:
                begun.append(self._add_later(picture, after, samples))
                if len(begun) > ahead:
                    begun.popleft()()
            after += samples
        for add in begun:
            add()

    def _add_later(self, picture: GrowingPicture, after: int, samples: int) -> Callable[[], None]:
        halves = self._halves_later(picture.vector, self._looked_at, after, samples)
        return lambda: picture.add(self._looked_at, halves(), samples)

    def _is_noisy(self, first: Pixels, second: Pixels) -> bool:
        """Whether noise is more than `NOISE_SHARE` of what the mean of two halves and the reference differ by.

        Noise that most pixels of the mask do not show is none: under lights of no extent only the silhouette has some.
        """
        first, second = (self._view.display(np.maximum(half[self._mask], 0.0)) for half in (first, second))
        noise = np.square(first - second) / 4.0  # of their mean
        if np.median(noise) < UNSEEN**2:
            return False
        difference = np.square(0.5 * (first + second) - self._reference)
        return bool(noise.mean() > NOISE_SHARE * difference.mean())

    def _samples_of_a_part(self, most: int) -> int:
        return _power(min(most, PATHS_OF_A_PART // len(self._looked_at), MOST_EVEN))

    def _halves_later(
        self, vector: Vector, pixels: NDArray[np.int64], after: int, samples: int
    ) -> Callable[[], list[NDArray[np.float32]]]:
        """Start `samples` more samples a pixel of both halves; a whole picture counts as one pass."""
        passes = self._renderer.passes
        seeds = ((half + after * _NEXT_SAMPLE) % 2**32 for half in (self._seed, self._seed ^ _SECOND_HALF))
        halves = [self._renderer.pixels_later(vector, pixels, seed=seed, spp=samples) for seed in seeds]
        self._renderer.passes = passes + len(pixels) / self._mask.size * samples / self._most
        return lambda: [half() for half in halves]


def _power(most: int) -> int:
    """At most so many samples, at least one; a power of two, for any other number is another kernel."""
    return 1 << max(most, 1).bit_length() - 1
