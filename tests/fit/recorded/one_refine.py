# SPDX-License-Identifier: Apache-2.0
"""The stage `refine` alone, from given values, where light is sampled."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.types.image import Pixels


def refine(renderer: Any, reference: Pixels, start: NDArray[np.float64], plan: RecordedPlan, seed: int) -> Any:
    """What the stage found and its recording, with residuals in deviations of the reference's noise."""
    from mfo_backend.fit.recorded.recording import Setting
    from mfo_backend.fit.recorded.refine import refine_sampled
    from mfo_backend.fit.result.course import Course
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    mask = renderer.target_mask()
    course = Course(renderer, ("refine",), lambda event: None, lambda: False, time.monotonic())
    setting = Setting(RecordedScene(renderer, int(mask.sum())), reference, mask, plan, seed, course)
    return refine_sampled(setting, [start])
