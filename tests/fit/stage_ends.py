# SPDX-License-Identifier: Apache-2.0
"""What a process that is killed at the end of a stage leaves behind."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from mfo_backend.types.event import BestValues, Event, StageEnd
from mfo_backend.types.parameter import ParameterTable
from mfo_backend.types.result import FitResult


def assert_stages_leave_their_values(events: Sequence[Event], result: FitResult, renderer: Any) -> None:
    """The values of every stage were told right before its end; all that were told are finite and inside the bounds."""
    table: ParameterTable = renderer.table
    told = [event for event in events if isinstance(event, (BestValues, StageEnd))]
    left = [before for before, event in pairwise(told) if isinstance(event, StageEnd)]
    assert [best.result.recovered for best in left if isinstance(best, BestValues)] == [s.values for s in result.stages]
    for event in told:
        if isinstance(event, BestValues):
            vector = table.pack(event.result.recovered)
            assert np.all((vector >= table.lower) & (vector <= table.upper))
            assert event.result.initial == result.initial
            assert (event.result.model, event.result.bounds) == (result.model, result.bounds)
