# SPDX-License-Identifier: Apache-2.0
"""Pictures of one material in several scenes, or from several cameras, rendered as one contact sheet."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels, Pullback
from ...types.parameter import Vector
from ..models.leaning_normals import share_own_normals
from ..pictures.mitsuba_renderer import MitsubaRenderer
from .contact_sheet import ContactSheet

_SCENES_APART = 0x85EBCA6B  # between the seeds of two pictures, so that their noise has nothing in common


class SheetRenderer:
    """The `Renderer` protocol for several renderers of the same parameters; a pass is one render of one picture.

    Parameters
    ----------
    gains
        Those of the `ContactSheet`; one each without.
    labels
        Its labels; numbers without.
    """

    def __init__(
        self,
        renderers: Sequence[MitsubaRenderer],
        gains: Sequence[float] | None = None,
        labels: Sequence[str] | None = None,
    ) -> None:
        first = renderers[0]
        self.renderers = tuple(renderers)
        share_own_normals([r.shape.bsdf() for r in renderers], [r.scene.integrator() for r in renderers])
        self.model, self.table, self.start = first.model, first.table, first.start
        self.light_paths, self.counter, self.graph = first.light_paths, first.counter, first.graph
        for renderer in renderers:
            renderer.table, renderer.start, renderer.counter = self.table, self.start, self.counter
        sizes = tuple((len(mask), mask.shape[1]) for mask in (renderer.target_mask() for renderer in renderers))
        numbers = [str(number) for number in range(1, len(sizes) + 1)]
        self.sheet = ContactSheet(sizes, tuple(gains or (1.0,) * len(sizes)), tuple(labels or numbers))

    @property
    def passes(self) -> float:
        """See `Renderer.passes`."""
        return self.counter.count

    def show(self, vector: Vector) -> None:
        """See `MitsubaRenderer.show`; in every picture."""
        for renderer in self.renderers:
            renderer.show(vector)

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer.image`."""
        return self.sheet.radiance(
            [r.image(vector, seed=seed_of(seed, number), spp=spp) for number, r in enumerate(self.renderers)]
        )

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """See `Renderer.image_and_pullback`."""
        seeds = [seed_of(seed, number) for number in range(len(self.renderers))]
        found = [r.image_and_pullback(vector, seed=s, spp=spp) for r, s in zip(self.renderers, seeds, strict=True)]

        def pullback(gradient: Pixels) -> Vector:
            parts = ((self.sheet.cut(gradient, n) * np.float32(g), n) for n, g in enumerate(self.sheet.gains))
            return np.sum([found[n][1](np.ascontiguousarray(part)) for part, n in parts], axis=0)

        return self.sheet.radiance([image for image, _ in found]), pullback

    def pixels_later(
        self, vector: Vector, pixels: NDArray[np.int64], *, seed: int, spp: int
    ) -> Callable[[], NDArray[np.float32]]:
        """See `MitsubaRenderer.pixels_later`, for flat indices of the sheet."""
        parts = [
            (chosen, self.sheet.gains[n], self.renderers[n].pixels_later(vector, own, seed=seed_of(seed, n), spp=spp))
            for n, chosen, own in self.sheet.parted(pixels)
        ]

        def wait() -> NDArray[np.float32]:
            found = np.zeros((len(pixels), 3), np.float32)
            for chosen, gain, later in parts:
                found[chosen] = later() * np.float32(gain)
            return found

        return wait

    def target_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.target_mask`."""
        return self.sheet.put([r.target_mask() for r in self.renderers])

    def otherwise_mask(self) -> NDArray[np.bool_]:
        """See `Renderer.otherwise_mask`."""
        return self.sheet.put([r.otherwise_mask() for r in self.renderers])


def seed_of(seed: int, number: int) -> int:
    """The seed of one of the pictures, counted from 0."""
    return (seed + number * _SCENES_APART) % 2**32
