# SPDX-License-Identifier: Apache-2.0
"""Base colours that make every target as bright as in the picture, so that the light between them is about right."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.sheet.sheet_renderer import SheetRenderer
from ...types.image import Pixels

COLOR = "base_color"
# Pictures, each of which scales all colours at once. Of two diffuse walls that see half of each other the worst channel
# was off by 0.35, 0.026, 0.007 and 0.0009 after one to four (tests/fit/materials/test_rounds.py).
STEPS = 4
LOOK_SAMPLES = 8  # of a pixel of a picture that tells how bright targets are, or by how much they have changed
# Times a colour may grow or shrink in one step, so that a target in the dark does not run away. No measurement.
MOST_CHANGE = 4.0
DIM = 1e-4  # of the brightest target: below, a ratio is noise. No measurement.


def evened_light(
    renderers: Sequence[MitsubaRenderer | SheetRenderer], masks: Sequence[NDArray[np.bool_]], light: Pixels, seed: int
) -> list[NDArray[np.float64]]:
    """Vectors whose targets have the mean radiance of the picture `light` (height, width, 3); the scene shows them.

    All but the base colours, and the colours that nodes make them of, is as in the scene. The values are no estimate of
    a material: they make up for whatever else differs, and serve as the surroundings of the others' first fits alone.
    """
    present = [renderer.start.copy() for renderer in renderers]
    wanted = [light[mask].mean(axis=0, dtype=np.float64) for mask in masks]
    dim = DIM * max(float(mean.max()) for mean in wanted)
    for _ in range(STEPS):
        for renderer, vector in zip(renderers, present, strict=True):
            renderer.show(vector)
        image = renderers[0].image(present[0], seed=seed, spp=LOOK_SAMPLES)
        for renderer, vector, mask, mean in zip(renderers, present, masks, wanted, strict=True):
            shown = image[mask].mean(axis=0, dtype=np.float64)
            for name in _colors(renderer):
                vector[renderer.table.slice_of(name)] *= np.clip(
                    (mean + dim) / (shown + dim), 1.0 / MOST_CHANGE, MOST_CHANGE
                )
            vector[:] = renderer.table.clip(vector)
    for renderer, vector in zip(renderers, present, strict=True):
        renderer.show(vector)
    return present


def _colors(renderer: MitsubaRenderer | SheetRenderer) -> tuple[str, ...]:
    """What the base colour of a target is made of: itself, or colours in its nodes, which it is mostly linear in."""
    if COLOR in renderer.table.names:
        return (COLOR,)
    return () if renderer.graph is None else renderer.graph.colors_of(COLOR)
