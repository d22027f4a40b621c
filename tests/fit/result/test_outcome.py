# SPDX-License-Identifier: Apache-2.0
"""The result of a fit from the pictures of its ends."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.paper.loop import Candidate
from mfo_backend.fit.result.outcome import START_KEPT, final_result
from mfo_backend.material.principled_parameters import BLENDER_PRINCIPLED
from mfo_backend.types.status import Status

TABLE = BLENDER_PRINCIPLED.select(["base_color", "roughness"])
PICTURE = np.zeros((2, 2, 3), np.float32)


@pytest.mark.parametrize("status", [Status.CONVERGED, Status.CANCELLED])
@pytest.mark.parametrize("best", [0, 1])
def test_it_says_what_was_found_and_whether_that_is_the_start(status, best):
    start = np.array([0.1, 0.2, 0.3, 0.4])
    renderer = SimpleNamespace(table=TABLE, start=start, model="blender_principled", passes=7.0)
    ends = [Candidate(start, PICTURE), Candidate(start + 0.1, PICTURE)]
    result = final_result(
        renderer,
        ends,
        best,
        status=status,
        stages=[],
        errors={"flip": (0.2, 0.1)},
        began=time.monotonic() - 5.0,
        notes=["one"],
    )
    assert (START_KEPT in result.message) == (best == 0 and status is Status.CONVERGED)
    assert result.message.startswith(status.sentence)
    assert result.initial == {"base_color": (0.1, 0.2, 0.3), "roughness": 0.4}
    assert result.recovered["roughness"] == pytest.approx(0.4 + 0.1 * best)
    assert result.bounds == {p.name: (p.lower, p.upper) for p in TABLE}
    assert (result.passes, result.notes, result.errors) == (7.0, ("one",), {"flip": (0.2, 0.1)})
    assert 5.0 <= result.seconds < 60.0
