# SPDX-License-Identifier: Apache-2.0
"""Pictures of a fit's ends under random numbers that no stage has seen, with as many samples as they need."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.baked_view import HALF_LEVEL
from ...metrics.flip.block_means import block_side, full_blocks, means_beside
from ...metrics.flip.flip_error import shown
from ...render.camera.widened_mask import widened
from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.pictures.renderer import Vector
from ...render.sheet.sheet_renderer import SheetRenderer
from ...types.event import PREVIEW_SIDE
from ...types.image import Encoding, Image, Pixels
from ..random_streams import Stream
from ..result.outcome import Candidate
from .fit_task import FitTask
from .region import blocks_around

FIRST_SAMPLES = 16  # of a pixel of a comparison: a quarter of the noise (squares) of a reference of 4 samples
FIRST_SAMPLES_EXACT = 8  # where every light is exact: for silhouettes and light over other surfaces
# Of a pixel of start and result, where the limits below allow it; more say little of a start, which is mostly far away
SHOWN_SAMPLES = 4
# Part of the squared difference from the reference that may be the picture's own noise; below, more samples would tell
# little. With 0.25 the root of the difference is at most 15 % too large.
NOISE_SHARE = 0.25
MOST_EVEN = 4  # samples of a part, stratified in each pixel; more would need another kernel and change little
# Paths of one picture: of a whole one, most of which may be background, and further ones where it is looked at. About
# a second and a second and a half on two processors; a picture of 256 x 256 stays below both
MOST_WHOLE, MOST_FURTHER = 1 << 21, 1 << 22
# Pixels: noise outside of them adds 0.0008 to the FLIP of a disc of 60 pixels, noise next to the disc 0.012
BLURRED = 4
PATHS_OF_A_PART = 1 << 19  # after twice as many, those of both halves, a request to stop is heard

_AROUND = 0x00A50000
_NEXT_SAMPLE = 0x9E3779B9  # as between the parts of one picture, so that none repeats another's numbers

# Parts of a picture: flat indices of their pixels, and radiance (pixels, 3) of each half
_Halves = list[tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]]


@dataclass(frozen=True)
class VerifiedEnd(Candidate):
    """A vector with its picture, scene-linear, whose two halves have no random numbers in common.

    Each half has so many `samples` a pixel where it is looked at. Unless it is `whole` it shows the start elsewhere.
    """

    halves: tuple[Pixels, Pixels] = field(repr=False)
    samples: int
    whole: bool


@dataclass
class GrowingPicture:
    """Two halves of a picture of a vector, and the samples that each of them has in a pixel that is looked at."""

    vector: Vector
    halves: list[Pixels]
    samples: int
    whole: bool = True

    def put(self, parts: _Halves) -> GrowingPicture:
        """Replace some pixels; returns itself."""
        for pixels, *halves in parts:
            for half, new in zip(self.halves, halves, strict=True):
                half.reshape(-1, 3)[pixels] = new
        return self

    def add(self, parts: _Halves, samples: int) -> None:
        """Take in further samples, as many of each half, of some pixels."""
        share = np.float32(samples / (self.samples + samples))
        for pixels, *halves in parts:
            for half, more in zip(self.halves, halves, strict=True):
                flat = half.reshape(-1, 3)
                flat[pixels] += share * (more - flat[pixels])
        self.samples += samples

    def end(self) -> VerifiedEnd:
        """The picture as it is now."""
        first, second = self.halves
        return VerifiedEnd(self.vector, 0.5 * (first + second), (first, second), self.samples, self.whole)


class Verifier(Protocol):
    """Pictures of a start and of ends under random numbers that no stage has seen, the same for all of them."""

    def begin(self, vector: Vector) -> Callable[[], Any]:
        """Start a picture of the start, or put it off; returns what waits for it."""
        ...

    def pictures(self, start: Callable[[], Any], ends: Sequence[Vector]) -> Sequence[Candidate]:
        """The start and the ends with pictures to compare them by; raises `Interrupted` where it was stopped."""
        ...

    def finished(self, end: Any) -> Candidate:
        """One of these with a picture that may be shown."""
        ...


class Verification:
    """Renders the ends of one fit; all of them see the same random numbers.

    A picture goes on where it is looked at: in the pixels that count, and next to them. Where these are many, they are
    compared at a fraction of the size (`metrics.flip.block_means`), and a pixel needs fewer samples. Differences and
    noise are compared in the values of the task's view, as every measure of a fit sees them compressed.

    An end's picture has `first` samples at least for a pixel of a comparison, and at most the settings' `verify_spp`
    for one of the picture. The first often say enough: under a noisy reference a picture without noise looks no nearer.
    """

    def __init__(self, renderer: MitsubaRenderer | SheetRenderer, task: FitTask, first: int = FIRST_SAMPLES) -> None:
        mask, most = task.counted, task.settings.verify_spp
        self._renderer, self._mask, self._view, self._should_stop = renderer, mask, task.view, task.should_stop
        self._side, self._encoding = block_side(mask), task.reference.encoding
        self._near = blocks_around(mask, self._side)
        self._compared = full_blocks(mask[self._near], self._side)
        self._reference = self._displayed(task.reference)
        self._seed = Stream.VERIFY.seed(task.settings.seed)
        close = widened(mask, BLURRED)
        self._looked_at, self._around = np.flatnonzero(close), np.flatnonzero(~close)
        # of one half, as all counts of samples from here on
        self._most = max(most // 2, 1)
        self._begun = _power(min(MOST_WHOLE // (2 * mask.size), first // 2, self._most, MOST_EVEN))
        self._first = max(min(first // (2 * self._side**2), self._most), self._begun)
        most_here = self._begun + MOST_FURTHER // (2 * len(self._looked_at))
        self._most_here = self._most if self._most <= most_here else _power(most_here)
        self._shown = min(SHOWN_SAMPLES // 2, self._most_here)

    def begin(self, vector: Vector) -> Callable[[], GrowingPicture]:
        """Start the first samples of a picture; returns what waits for it."""
        later = self._halves_later(vector, (self._looked_at, self._around), 0, self._begun)
        shape = (*self._mask.shape, 3)
        return lambda: GrowingPicture(vector, [np.zeros(shape, np.float32) for _ in (0, 1)], self._begun).put(later())

    def pictures(self, start: Callable[[], GrowingPicture], ends: Sequence[Vector]) -> list[VerifiedEnd]:
        """The pictures of the start, which has begun, and of the fit's ends, for comparisons.

        The ends are near each other, so all of them have as many samples as the one that needs most. A single end is
        whole: it is most likely the result.
        """
        if len(ends) == 1:
            begun = [self.begin(ends[0])]
            first = start()
        else:
            later = [self._halves_later(end, (self._looked_at,), 0, self._begun) for end in ends]
            first = start()
            begun = [partial(self._within, first, *pair) for pair in zip(ends, later, strict=True)]
        last = [end() for end in begun]
        self._grow([first], self._shown)
        self._grow(last, self._first)
        return [picture.end() for picture in (first, *last)]

    def finished(self, end: VerifiedEnd) -> VerifiedEnd:
        """The same, whole and with the samples that a picture needs that is shown."""
        if end.whole and end.samples >= self._shown:
            return end
        picture = GrowingPicture(end.vector, [half.copy() for half in end.halves], end.samples, end.whole)
        if not end.whole:
            picture.put(self._halves_later(end.vector, (self._around,), 0, self._begun, seed=self._seed ^ _AROUND)())
            picture.whole = True
        self._add([picture], self._shown)
        return picture.end()

    def like(self, end: VerifiedEnd, vector: Vector) -> VerifiedEnd:
        """A picture of another vector that may be compared with that of an end: the same random numbers and samples."""
        begun = self._halves_later(vector, (self._looked_at,), 0, self._begun)()
        whole = not len(self._around)
        picture = GrowingPicture(vector, [half.copy() for half in end.halves], self._begun, whole).put(begun)
        self._add([picture], end.samples)
        return picture.end()

    def farther(self, end: VerifiedEnd, other: VerifiedEnd) -> tuple[float, float]:
        """How much farther from the reference the `other` is, by squared differences of display values, and the
        standard error of that; noise of the pictures has no part in the mean."""
        first, second = (
            np.prod([self._displayed(Image(half, Encoding.LINEAR)) - self._reference for half in each.halves], axis=0)
            for each in (end, other)
        )
        more = (second - first).reshape(len(first), -1).mean(axis=1)
        return float(more.mean()), float(more.std() / np.sqrt(len(more)))

    def glance(self, vector: Vector, *, elsewhere: Pixels) -> Pixels:
        """A quick picture of a vector over another one `elsewhere`, scene-linear (height, width, 3).

        It has the first samples of half a picture, in one pixel of every block that a preview shows as one, so that its
        cost does not grow with the frame.
        """
        height, width = self._mask.shape
        row, column = np.divmod(self._looked_at, width)
        side = -(-max(height, width) // PREVIEW_SIDE)
        blocks, of_block = np.unique(row // side * width + column // side, return_index=True, return_inverse=True)[1:]
        seed = Stream.PREVIEW.seed(self._seed)
        seen = self._renderer.pixels_later(vector, self._looked_at[blocks], seed=seed, spp=self._begun)()
        picture = elsewhere.astype(np.float32)
        picture.reshape(-1, 3)[self._looked_at] = seen[of_block]
        return picture

    def _within(self, start: GrowingPicture, vector: Vector, later: Callable[[], _Halves]) -> GrowingPicture:
        whole = not len(self._around)
        return GrowingPicture(vector, [half.copy() for half in start.halves], self._begun, whole).put(later())

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
        later = self._halves_later(picture.vector, (self._looked_at,), after, samples)
        return lambda: picture.add(later(), samples)

    def _is_noisy(self, first: Pixels, second: Pixels) -> bool:
        """Whether noise is more than `NOISE_SHARE` of what the mean of two halves and the reference differ by.

        Noise that most pixels of a comparison do not show is none: under lights of no extent only the silhouette has
        some.
        """
        first, second = (self._displayed(Image(half, Encoding.LINEAR)) for half in (first, second))
        noise = np.square(first - second) / 4.0  # of their mean
        if np.median(noise) < HALF_LEVEL**2:
            return False
        difference = np.square(0.5 * (first + second) - self._reference)
        return bool(noise.mean() > NOISE_SHARE * difference.mean())

    def _displayed(self, image: Image) -> NDArray[np.float32]:
        """Display values of the pixels of a comparison."""
        near = Image(image.pixels[self._near], image.encoding)
        return shown(means_beside(self._encoding, near, self._side, self._view), self._view)[self._compared]

    def _samples_of_a_part(self, most: int) -> int:
        return _power(min(most, PATHS_OF_A_PART // len(self._looked_at), MOST_EVEN))

    def _halves_later(
        self,
        vector: Vector,
        parts: Sequence[NDArray[np.int64]],
        after: int,
        samples: int,
        *,
        seed: int | None = None,
    ) -> Callable[[], _Halves]:
        """Start `samples` more samples a pixel of both halves of some parts of a picture, which as a whole is one pass.

        Numbers belong to places in the launch, so the first part has the same whatever follows.
        """
        pixels = np.concatenate([part for part in parts for _ in (0, 1)])
        seed = ((self._seed if seed is None else seed) + after * _NEXT_SAMPLE) % 2**32
        counter = self._renderer.counter
        with counter.uncounted():  # it counts any number of samples as one pass
            later = self._renderer.pixels_later(vector, pixels, seed=seed, spp=samples)
        counter.add(len(pixels) / (2 * self._mask.size) * samples / self._most)

        def wait() -> _Halves:
            found = np.split(later(), np.cumsum([len(part) for part in parts for _ in (0, 1)])[:-1])
            return list(zip(parts, found[::2], found[1::2], strict=True))

        return wait


def _power(most: int) -> int:
    """At most so many samples, at least one; a power of two, for any other number is another kernel."""
    return 1 << max(most, 1).bit_length() - 1
