# SPDX-License-Identifier: Apache-2.0
"""The exposures HDR-FLIP compares at, chosen from the reference alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from ..display.colour import luminance
from ..pixels.pixel_check import check_mask
from .tone_curve import ToneCurve

Array = NDArray[np.floating]

_SMALLEST = 2.0**-23  # FLT_EPSILON: where flip-evaluator 1.7 floors the median of a mostly black image
_LIMIT_EV = 60.0


@dataclass(frozen=True)
class ExposureRange:
    """`count` exposures in stops, evenly spaced from `start` to `stop`."""

    start: float
    stop: float
    count: int

    def __post_init__(self) -> None:
        if not -_LIMIT_EV <= self.start <= self.stop <= _LIMIT_EV:
            raise BadInputError(
                f"Exposure range is {self.start} to {self.stop} stops: start must not exceed stop, and both lie "
                f"between -{_LIMIT_EV:g} and {_LIMIT_EV:g}."
            )
        if not 2 <= self.count <= 200:
            raise BadInputError(f"Exposure count is {self.count}: it must lie between 2 and 200.")

    @property
    def values(self) -> list[float]:
        """The `count` exposures in stops."""
        return np.linspace(self.start, self.stop, self.count).tolist()


def official_exposures(reference: Array, curve: ToneCurve = ToneCurve()) -> ExposureRange:  # noqa: B008  # frozen
    """The range of Andersson et al. 2021, as flip-evaluator 1.7 computes it: for reporting.

    The brightest and the median pixel of linear `reference` (height, width, 3) map to 0.85. A median (or maximum) of
    zero counts as 2^-23, so an object on black is looked at up to 24 stops brighter.
    """
    return _range_of(luminance(np.maximum(reference, 0)).ravel(), curve)


def lit_exposures(
    reference: Array,
    mask: NDArray[np.bool_] | None = None,
    curve: ToneCurve = ToneCurve(),  # noqa: B008  # frozen
) -> ExposureRange:
    """The same rule over the pixels of `mask` (height, width), by default those that are not black: for losses.

    A black background says nothing about the object's brightness; counted in, it would add a dozen exposures that
    show nothing but amplified noise.

    Raises
    ------
    BadInputError
        If the mask has another size or is empty.
    """
    values = luminance(np.maximum(reference, 0))
    if mask is None:
        return _range_of(values[values > 0], curve)
    check_mask(mask, values.shape)
    return _range_of(values[mask], curve)


def _range_of(values: Array, curve: ToneCurve) -> ExposureRange:
    middle = len(values) // 2  # the upper median, as FLIP.h takes it
    median = float(np.partition(values, middle)[middle]) if values.size else 0.0
    largest = float(values.max(initial=0))
    start = np.log2(curve.bright_input / max(largest, _SMALLEST))
    stop = np.log2(curve.bright_input / max(median, _SMALLEST))
    start, stop = (float(np.clip(ev, -_LIMIT_EV, _LIMIT_EV)) for ev in (min(start, stop), stop))
    return ExposureRange(start, stop, max(2, int(np.ceil(stop - start))))
