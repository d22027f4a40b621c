# SPDX-License-Identifier: Apache-2.0
"""Materials and judged fits of them, as a job has them."""

from __future__ import annotations

import numpy as np

from mfo_backend.job.run.class_trials import Fitted
from mfo_backend.job.run.material_classes import other_classes
from mfo_backend.types.result import FitResult
from mfo_backend.types.status import Status
from mfo_backend.types.verdict import Cause, Difference, Judgement, Verdict


def material(**values):
    return {"sockets": {name.replace("_", " "): {"value": value, "linked": False} for name, value in values.items()}}


def named(name, own=None):
    return next(other for other in other_classes(own or material(), 4.0) if other.name == name)


def judgement(verdict, cause=None, visible=0.2):
    return Judgement(verdict, cause, Difference(visible + 0.05, 0.05, visible / 2.0, visible / 3.0, visible / 2.0))


def fitted(visible, verdict=Verdict.DIFFERENT, status=Status.DIFFERENT):
    result = FitResult(
        status, "", "blender_principled", {"metallic": 0.0}, {"metallic": 0.4}, {}, (), {"flip": (0.3, visible)},
        1.0, 2.0, judgement=judgement(verdict, Cause.MATERIAL, visible),
    )  # fmt: skip
    picture = np.full((2, 2, 3), visible, np.float32)
    return Fitted(result, picture, picture, np.ones((2, 2), bool))
