# SPDX-License-Identifier: Apache-2.0
"""The task of one fit: scene, reference and settings, checked, and what every route needs of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.baked_view import HALF_LEVEL, BakedView
from ...metrics.display.tone_mapping import DisplayView, View
from ...metrics.pixels.pixel_check import check_finite
from ...render.pictures.renderer import Renderer
from ...render.sheet.contact_sheet import ContactSheet
from ...types.event import Listener
from ...types.image import Encoding, Image, Pixels
from ..candidates import Candidates
from ..settings import FitSettings
from .checked_reference import check_reference, counted_pixels
from .picture_judge import PictureJudge
from .region import fill_outside


@dataclass(frozen=True)
class FitTask:
    """What is to be fitted, and who listens.

    Attributes
    ----------
    display
        The view of a display-encoded reference as the user gave it; None stands for plain sRGB.
    view
        What a display shows: `display` for a display-encoded reference, else an exposure chosen for the picture.
    mask, counted
        Pixels, True (height, width), that see the target and count in the reference, and those of the settings' region.
    light
        The reference as scene-linear radiance, float32 (height, width, 3), not negative.
    clipped
        1 where only a lower bound of the radiance is known, else 0; None for a linear reference.
    should_stop
        Polled before every iteration and between stages and pictures.
    began
        The fit's begin on the monotonic clock, seconds.
    nearer_than
        FLIP beyond noise that a fit from another class has to come below; None where there is none before it.
    candidates
        The scene's other cameras and lights, from which a further picture could be proposed.
    noted
        Whether the export has left something out, which may be why a result does not match.
    """

    renderer: Renderer
    reference: Image
    settings: FitSettings
    display: View | None
    view: View
    mask: NDArray[np.bool_] = field(repr=False)
    counted: NDArray[np.bool_] = field(repr=False)
    light: Pixels = field(repr=False)
    clipped: NDArray[np.float32] | None = field(repr=False)
    listener: Listener
    should_stop: Callable[[], bool]
    began: float
    nearer_than: float | None = None
    candidates: Candidates = field(default_factory=Candidates)
    noted: bool = False

    @property
    def sheet(self) -> ContactSheet | None:
        """Where the pictures are, if these are several on one sheet."""
        return getattr(self.renderer, "sheet", None)

    @property
    def linear(self) -> bool:
        """Whether the reference holds radiance and not a display's values."""
        return self.reference.encoding is Encoding.LINEAR

    @property
    def measure(self) -> str:
        """The loss by which a result is chosen: the last that the settings name, else FLIP in the reference's range."""
        if self.settings.losses is not None:
            return self.settings.stage_names(self.reference.encoding)[-1]
        return "flip-hdr" if self.linear and self.settings.range != "ldr" else "flip-ldr"

    def judge(self, background: Pixels, *, blurred: bool) -> PictureJudge:
        """The `measure` of pictures, with `background` where they do not count; see `PictureJudge`."""
        reference, mask, settings, view = self.reference, self.mask, self.settings, self.view
        return PictureJudge(self.measure, reference, background, mask, settings, view, blurred=blurred)

    def only_counted(self, result: Pixels) -> FitTask:
        """The task with a reference that shows the `result` itself where it does not count.

        What looks at neighbours, as FLIP does, finds no difference there. `result` is radiance (height, width, 3).
        """
        counts = self.reference.counts
        if counts is None:
            return self
        return replace(self, reference=fill_outside(self.reference, result, counts, self.view.display))


def check_task(
    renderer: Renderer,
    reference: Image,
    settings: FitSettings,
    display: View | None,
    listener: Listener,
    should_stop: Callable[[], bool],
) -> FitTask:
    """The task, if reference and scene fit together.

    Raises
    ------
    BadInputError
        If the reference has another size, shows nothing or has pixels that are not finite, or if the camera does not
        see the target.
    """
    began = time.monotonic()
    mask = check_reference(reference, renderer.target_mask())
    check_finite(reference.pixels, "The reference")
    if reference.encoding is Encoding.SRGB:
        view = display or DisplayView()
    else:
        view = DisplayView.for_scene(reference.pixels, mask)
    return FitTask(
        renderer=renderer,
        reference=reference,
        settings=settings,
        display=display,
        view=view,
        mask=mask,
        counted=counted_pixels(reference, mask, settings),
        light=linear_pixels(reference, view),
        clipped=clipped_pixels(reference, view),
        listener=listener,
        should_stop=should_stop,
        began=began,
    )


def linear_pixels(reference: Image, view: View) -> Pixels:
    """Scene-linear values of a reference; those above a display's white are lost."""
    if reference.encoding is Encoding.LINEAR:
        return np.maximum(reference.pixels, 0.0)
    assert isinstance(view, DisplayView | BakedView)
    return view.linear(reference.pixels)


def clipped_pixels(reference: Image, view: View) -> NDArray[np.float32] | None:
    """1 where only a lower bound of the radiance is known, else 0; None for a linear reference."""
    if reference.encoding is Encoding.LINEAR:
        return None
    top = view.top if isinstance(view, BakedView) else 1 - HALF_LEVEL
    return (reference.pixels >= top).astype(np.float32)
