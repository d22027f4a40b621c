# SPDX-License-Identifier: Apache-2.0
"""The result of a fit from the pictures of its ends, for every preset alike."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from ...render.renderer import Renderer
from ...types.certainty import Certainty, WeakCombination
from ...types.result import FitResult, StageReport
from ...types.status import Status
from ..paper.loop import Candidate

START_KEPT = "Nothing was better than the start, so the start was kept."
SQUARES_KEPT = "No perceptual stage was better in a picture of its own, so the end of {stage!r} was kept."


def final_result(
    renderer: Renderer,
    pictures: Sequence[Candidate],
    best: int,
    *,
    status: Status,
    stages: Sequence[StageReport],
    errors: Mapping[str, tuple[float, float]],
    began: float,
    certainty: Mapping[str, Certainty] | None = None,
    notes: Sequence[str] = (),
    weak_combinations: Sequence[WeakCombination] = (),
) -> FitResult:
    """What a fit has found.

    Parameters
    ----------
    pictures
        The ends with their pictures; the first is the scene's own material.
    best
        Number of the end that is the result. If that is the first, the message says so, unless the fit was cancelled.
    began
        The fit's begin on the monotonic clock.
    """
    message = status.sentence
    if best == 0 and status is not Status.CANCELLED:
        message += f" {START_KEPT}"
    table = renderer.table
    return FitResult(
        status=status,
        message=message,
        model=renderer.model,
        initial=table.unpack(renderer.start),
        recovered=table.unpack(pictures[best].vector),
        bounds={p.name: (p.lower, p.upper) for p in table},
        stages=tuple(stages),
        errors=dict(errors),
        seconds=time.monotonic() - began,
        passes=renderer.passes,
        certainty=dict(certainty or {}),
        notes=tuple(notes),
        weak_combinations=tuple(weak_combinations),
    )
