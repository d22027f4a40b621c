# SPDX-License-Identifier: Apache-2.0
"""A whole fit: check the reference, run the stages, verify with fresh random numbers, keep what is really best."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...metrics.loss import Loss
from ...metrics.tone_mapping import View
from ...render.renderer import Interrupted, Renderer
from ...types.event import Listener, Started
from ...types.image import Image, Pixels
from ...types.result import FitResult
from ...types.status import Status
from ..judge.checked_reference import VERIFY_STREAM, check_reference, counted_pixels, stage_losses
from ..judge.picture_errors import picture_errors
from ..result.outcome import final_result
from ..settings import FitSettings
from .loop import Candidate, run_stages


@dataclass(frozen=True)
class FitOutcome:
    """The result of a fit with the pictures of its start and its end, scene-linear and under one seed.

    The fit looked at the pixels that are `counted`, True (height, width); others may have fewer samples.
    `result_halves` are two pictures of the end whose random numbers have nothing in common, where there are such.
    """

    result: FitResult
    start_image: Pixels = field(repr=False)
    result_image: Pixels = field(repr=False)
    counted: NDArray[np.bool_] = field(repr=False)
    result_halves: tuple[Pixels, Pixels] | None = field(default=None, repr=False)


def fit_material(
    renderer: Renderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
) -> FitOutcome:
    """Recover the renderer's parameters from a picture of the same scene.

    The result is the best of start and all stages under the last loss, measured on verification pictures with new
    random numbers and more samples. So it is never worse than the start, and the perceptual stage never makes the
    result of the stage before worse. A cancelled fit is not verified: its best values come back at once.

    Parameters
    ----------
    display
        View of a display-encoded reference; see `metrics.loss.make_loss`.
    should_stop
        Polled before every iteration and between the stages and pictures after them.

    Raises
    ------
    BadInputError
        If reference and scene do not fit together or the camera does not see the target.
    """
    began = time.monotonic()
    mask = renderer.target_mask()
    check_reference(reference, mask)
    names = settings.stage_names(reference.encoding)
    start = Candidate(renderer.start, renderer.image(renderer.start, seed=settings.seed, spp=settings.spp))
    losses = stage_losses(names, reference, start.image, mask, settings, display)
    listener(Started(stages=names, parameters=renderer.table.names, seconds=time.monotonic() - began))
    stages = run_stages(renderer, losses, start, settings, listener=listener, should_stop=should_stop, began=began)
    candidates, status = stages.candidates, stages.status
    if status is not Status.CANCELLED:
        verified = _verify(renderer, candidates, settings, should_stop)
        if verified is None:
            status = Status.CANCELLED
        else:
            candidates = verified
    best = _best(candidates, losses[-1])
    counted = counted_pixels(mask, settings)
    errors = picture_errors(reference, candidates[0].image, candidates[best].image, mask, counted, display)
    result = final_result(renderer, candidates, best, status=status, stages=stages.reports, errors=errors, began=began)
    return FitOutcome(result, candidates[0].image, candidates[best].image, counted)


def _verify(
    renderer: Renderer, candidates: Sequence[Candidate], settings: FitSettings, should_stop: Callable[[], bool]
) -> tuple[Candidate, ...] | None:
    """The candidates with pictures under a new seed, or None if the user cancelled meanwhile."""
    seed = settings.seed ^ VERIFY_STREAM
    verified = []
    for candidate in candidates:
        if should_stop():
            return None
        try:
            image = renderer.image(candidate.vector, seed=seed, spp=settings.verify_spp)
        except Interrupted:
            return None
        verified.append(Candidate(candidate.vector, image))
    return tuple(verified)


def _best(candidates: Sequence[Candidate], loss: Loss) -> int:
    """Index of the least loss; of equal ones the earliest."""
    return int(np.argmin([loss.value(candidate.image) for candidate in candidates]))
