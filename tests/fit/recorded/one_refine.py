# SPDX-License-Identifier: Apache-2.0
"""The stage `refine` alone, from given values."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.squares.problem import Refined
from mfo_backend.types.image import Pixels


def refine(
    renderer: Any, reference: Pixels, start: NDArray[np.float64], plan: RecordedPlan, seed: int
) -> tuple[Any, Refined]:
    """The fit and what its stage `refine` found, with residuals in deviations of the reference's noise."""
    from mfo_backend.fit.recorded.stages import RecordedFit
    from mfo_backend.fit.result.course import Course
    from mfo_backend.fit.squares.residuals import RelativeResidual, WeightedResidual
    from mfo_backend.render.recorded_scene import RecordedScene

    mask = renderer.target_mask()
    course = Course(renderer, ("refine",), lambda event: None, lambda: False, time.monotonic())
    fit = RecordedFit(RecordedScene(renderer, int(mask.sum())), reference, mask, plan, seed, course)
    fit.paths = None  # `refine` makes its own
    return fit, fit.refine(start, RelativeResidual, WeightedResidual)
