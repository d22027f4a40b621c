# SPDX-License-Identifier: Apache-2.0
"""Whether a value is what a fit says of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...fit.tolerances import DETERMINED_BELOW
from ...types.parameter import Parameter

_INTERVAL = 1.96  # standard deviations: 95 % of a normal distribution


def miss(found: ArrayLike, truth: ArrayLike, parameter: Parameter) -> NDArray[np.float64]:
    """How far each component is from the truth, or from the nearest value in the box; (n,), in the value's own unit."""
    return np.abs(np.subtract(found, np.clip(truth, parameter.lower, parameter.upper))).ravel()


def is_wrongly_determined(missed: NDArray[np.float64], sd: ArrayLike, parameter: Parameter) -> bool:
    """Whether a value called determined is off by more than three deviations and by more than "determined" promises."""
    least = DETERMINED_BELOW * (parameter.upper - parameter.lower)
    return bool(np.any(missed > np.maximum(3.0 * np.asarray(sd), least)))


def inside(missed: NDArray[np.float64], sd: ArrayLike) -> int:
    """How many components lie within the 95 % interval."""
    return int(np.sum(missed <= _INTERVAL * np.asarray(sd)))
