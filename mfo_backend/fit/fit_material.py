# SPDX-License-Identifier: Apache-2.0
"""A whole fit: check the reference, run the stages, verify with fresh random numbers, keep what is really best."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..metrics.loss import Loss, make_loss
from ..metrics.tone_mapping import DisplayView
from ..render.renderer import Renderer
from ..types.errors import BadInputError
from ..types.event import Listener, Started
from ..types.image import Encoding, Image, Pixels
from ..types.result import FitResult
from ..types.status import Status
from .region import MaskedLoss, fill_outside
from .settings import FitSettings
from .stages import Candidate, run_stages

_VERIFY_STREAM = 0x5EED0000  # far from the seeds users choose, so that no iteration saw these random numbers


@dataclass(frozen=True)
class FitOutcome:
    """The result of a fit with the pictures of its start and its end, scene-linear and under one seed."""

    result: FitResult
    start_image: Pixels = field(repr=False)
    result_image: Pixels = field(repr=False)


def fit_material(
    renderer: Renderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: DisplayView | None = None,
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
    _check(reference, mask)
    names = settings.stage_names(reference.encoding)
    start = Candidate(renderer.start, renderer.image(renderer.start, seed=settings.seed, spp=settings.spp))
    losses = _losses(names, reference, start.image, mask, settings, display)
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
    message = status.sentence
    if best == 0 and status is not Status.CANCELLED:
        message += " Nothing was better than the start, so the start was kept."
    result = FitResult(
        status=status,
        message=message,
        model=renderer.model,
        initial=renderer.table.unpack(renderer.start),
        recovered=renderer.table.unpack(candidates[best].vector),
        bounds={p.name: (p.lower, p.upper) for p in renderer.table},
        stages=stages.reports,
        errors=_errors(reference, candidates[0].image, candidates[best].image, mask, display),
        seconds=time.monotonic() - began,
        passes=renderer.passes,
    )
    return FitOutcome(result, candidates[0].image, candidates[best].image)


def _check(reference: Image, mask: NDArray[np.bool_]) -> None:
    height, width = mask.shape
    if (reference.height, reference.width) != (height, width):
        raise BadInputError(
            f"Reference is {reference.width}x{reference.height} but the scene renders {width}x{height}: "
            "give a picture of that size or change the render resolution."
        )
    if not mask.any():
        raise BadInputError("The camera does not see the target: move the camera or unhide the object.")
    if not reference.pixels[mask].any():
        raise BadInputError("The reference is black where the target is: check the picture and its light.")


def _losses(
    names: Sequence[str],
    reference: Image,
    background: Pixels,
    mask: NDArray[np.bool_],
    settings: FitSettings,
    display: DisplayView | None,
) -> list[Loss]:
    if settings.region == "image":
        return [make_loss(name, reference, mask=mask, display=display) for name in names]
    shown = fill_outside(reference, background, mask, (display or DisplayView()).display)
    return [MaskedLoss(make_loss(name, shown, mask=mask, display=display), background, mask) for name in names]


def _verify(
    renderer: Renderer, candidates: Sequence[Candidate], settings: FitSettings, should_stop: Callable[[], bool]
) -> tuple[Candidate, ...] | None:
    """The candidates with pictures under a new seed, or None if the user cancelled meanwhile."""
    seed = settings.seed ^ _VERIFY_STREAM
    verified = []
    for candidate in candidates:
        if should_stop():
            return None
        verified.append(
            Candidate(candidate.vector, renderer.image(candidate.vector, seed=seed, spp=settings.verify_spp))
        )
    return tuple(verified)


def _best(candidates: Sequence[Candidate], loss: Loss) -> int:
    """Index of the least loss; of equal ones the earliest."""
    return int(np.argmin([loss.value(candidate.image) for candidate in candidates]))


def _errors(
    reference: Image, start: Pixels, result: Pixels, mask: NDArray[np.bool_], display: DisplayView | None
) -> dict[str, tuple[float, float]]:
    """Mean differences of the whole pictures, [start, result]; HDR-FLIP only for a linear reference."""
    linear = reference.encoding is Encoding.LINEAR
    names = {"flip": "flip-ldr", "mse": "mse-hdr" if linear else "mse-ldr"} | (
        {"hdr_flip": "flip-hdr"} if linear else {}
    )
    errors = {}
    for key, name in names.items():
        loss = make_loss(name, reference, mask=mask, display=display)
        errors[key] = (loss.value(start), loss.value(result))
    return errors
