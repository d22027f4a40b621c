# SPDX-License-Identifier: Apache-2.0
"""Several references as the reference of one contact sheet, and the materials' renderers on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.baked_view import BakedView
from ...metrics.display.colour import luminance
from ...metrics.display.tone_mapping import DisplayView, View
from ...metrics.pixels.pixel_check import check_finite
from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.sheet.contact_sheet import ContactSheet
from ...render.sheet.sheet_renderer import SheetRenderer
from ...types.errors import BadInputError
from ...types.image import Encoding, Image
from ..judge.checked_reference import check_reference

_WHITE_LOST = (
    "Picture {label} is scene-linear and others are not: it was put through their view, and what is brighter than a "
    "display's white counts as white."
)


@dataclass(frozen=True)
class SheetTask:
    """A sheet's renderer for each material, its reference, the view of its radiance, and what was done to pictures."""

    renderers: tuple[SheetRenderer, ...]
    reference: Image
    display: View | None
    notes: tuple[str, ...] = ()

    @property
    def renderer(self) -> SheetRenderer:
        """That of the first material, or the only one."""
        return self.renderers[0]


def one_sheet(
    renderers: Sequence[Sequence[MitsubaRenderer]],
    references: Sequence[Image],
    views: Sequence[View],
    labels: Sequence[str],
) -> SheetTask:
    """The task of fitting all pictures together; `labels` are what sentences call them.

    Each picture has a renderer for each of the materials, in one order; some of these it may not show.

    Scene-linear pictures count alike, however bright their light is. Display pictures are seen through one view; their
    exposures may differ.

    Raises
    ------
    BadInputError
        With the picture's number: if it does not fit to its scene or is seen through another view than the others.
    """
    masks = []
    for label, reference, here in zip(labels, references, renderers, strict=True):
        try:
            masks.append(check_reference(reference, np.any([r.target_mask() for r in here], axis=0)))
            check_finite(reference.pixels, "The reference")
        except BadInputError as error:
            raise BadInputError(f"Picture {label}: {error}") from error
    display, notes, shown = None, [], [reference.pixels for reference in references]
    if all(reference.encoding is Encoding.LINEAR for reference in references):
        light = [float(luminance(np.maximum(r.pixels, 0.0))[m].mean()) for r, m in zip(references, masks, strict=True)]
        gains = [light[0] / level if level > 0.0 else 1.0 for level in light]
    else:
        of_display = [n for n, reference in enumerate(references) if reference.encoding is Encoding.SRGB]
        display = views[of_display[0]]
        gains = [_gain(views[n] if n in of_display else display, display, labels[n]) for n in range(len(references))]
        for n, label in enumerate(labels):
            if n not in of_display:
                notes.append(_WHITE_LOST.format(label=label))
                shown[n] = display.display(np.maximum(shown[n], 0.0)).astype(np.float32)
    of_materials = tuple(SheetRenderer(of_one, gains, labels) for of_one in zip(*renderers, strict=True))
    sheet = of_materials[0].sheet
    pixels = sheet.radiance(shown).astype(np.float32) if display is None else sheet.put(shown)
    encoding = Encoding.LINEAR if display is None else Encoding.SRGB
    return SheetTask(of_materials, Image(pixels, encoding, counts=_counts(sheet, references)), display, tuple(notes))


def _counts(sheet: ContactSheet, references: Sequence[Image]) -> NDArray[np.bool_] | None:
    """What counts on the sheet; None where all of every picture does."""
    if all(reference.counts is None for reference in references):
        return None
    whole = [np.ones((r.height, r.width), np.bool_) if r.counts is None else r.counts for r in references]
    return sheet.put(whole)


def _gain(view: View, common: View, label: str) -> float:
    """What radiance is multiplied with so that `common` shows what `view` does."""
    if isinstance(view, DisplayView) and isinstance(common, DisplayView) and view.gamma == common.gamma:
        return 2.0 ** (view.exposure_ev - common.exposure_ev)
    if isinstance(view, BakedView) and isinstance(common, BakedView):
        same_range = (view.log2_min, view.log2_max) == (common.log2_min, common.log2_max)
        if same_range and np.array_equal(view.table, common.table):
            return 1.0
    raise BadInputError(
        f"Picture {label} was made under another view transform than the first display picture: give all pictures "
        "of one fit as EXR, or render them under one view."
    )
