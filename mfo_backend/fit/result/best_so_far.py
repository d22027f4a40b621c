# SPDX-License-Identifier: Apache-2.0
"""The best values so far, told while the fit runs, so that they outlive a process that is killed."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from ...render.pictures.renderer import Renderer
from ...types.event import BestValues, Listener
from ...types.status import Status
from .outcome import result_at

ONCE_SECONDS = 1.0  # no more than one file of best values, and one preview, in this time


class BestSoFar:
    """Tells the listener new best values, at most once a second and at the end of every stage.

    `began` is the fit's begin on the clock of every `now`. For a second from it nothing is told: a scan's first guess
    is no result.
    """

    def __init__(self, renderer: Renderer, listener: Listener, began: float) -> None:
        self._renderer, self._listener, self._began = renderer, listener, began
        self._told = began
        self._stage = ""
        self._vector: NDArray[np.float64] | None = None  # until it has been told

    def found(self, stage: str, vector: NDArray[np.float64]) -> None:
        """Note the best vector under the loss of `stage`; what is not finite is left out."""
        if np.isfinite(vector).all():
            self._stage, self._vector = stage, vector.copy()

    def tell(self, now: float | None = None, *, at_once: bool = False) -> None:
        """Tell what was noted since, where it is time for it; `now` is the monotonic clock by default."""
        now = time.monotonic() if now is None else now
        if self._vector is None or not (at_once or now - self._told >= ONCE_SECONDS):
            return
        # a scan holds its nodes, which narrowed bounds may leave out
        vector, self._vector, self._told = self._renderer.table.clip(self._vector), None, now
        message = f"The fit ended by itself in the stage {self._stage!r}; these are its best values until then."
        self._listener(BestValues(result_at(self._renderer, vector, Status.FAILED, message, now - self._began)))
