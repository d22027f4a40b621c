# SPDX-License-Identifier: Apache-2.0
"""HDR-FLIP and its gradient: the largest LDR-FLIP error of every pixel over a range of exposures.

References
----------
Andersson et al., "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics 2021.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..pixels.pixel_check import check_finite, check_pair
from ..pixels.side_by_side import side_by_side
from .exposure_range import ExposureRange, official_exposures
from .flip_filters import DEFAULT_PIXELS_PER_DEGREE
from .flip_reference import FlipComparison, FlipReference, comparisons
from .ldr_flip import pixels_of, planes_of
from .tone_curve import ToneCurve

Array = NDArray[np.floating]


# Up to this many pixels times exposures everything the gradient needs is kept, some 100 bytes for each; beyond, the
# exposures that win somewhere are computed again
_KEPT = 2**23


class HdrFlip:
    """HDR-FLIP against one reference whose features are computed once.

    Parameters
    ----------
    reference
        Linear Rec.709 pixels (height, width, 3); float64 is computed in float64, everything else in float32.
        Negative values count as 0.
    exposures
        The range; by default `official_exposures`.
    curve
        The tone curve.
    pixels_per_degree
        How large the picture is seen.

    Raises
    ------
    BadInputError
        If a pixel is NaN or infinite.
    """

    def __init__(
        self,
        reference: Array,
        *,
        exposures: ExposureRange | None = None,
        curve: ToneCurve = ToneCurve(),  # noqa: B008  # frozen
        pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE,
    ) -> None:
        check_finite(reference, "The reference")
        self.dtype = np.dtype(np.float64 if reference.dtype == np.float64 else np.float32)
        self.exposures = exposures or official_exposures(reference, curve)
        self._curve = curve
        planes = planes_of(reference.astype(self.dtype, copy=False))
        self._references = [
            FlipReference(planes, pixels_per_degree, partial(curve.apply, exposure_ev=ev))
            for ev in self.exposures.values
        ]

    def map(self, test: Array) -> Array:
        """The error map (height, width) in [0, 1] of linear pixels (height, width, 3); negative values count as 0."""
        planes = planes_of(test.astype(self.dtype, copy=False))
        error = np.zeros(planes.shape[1:], self.dtype)
        for comparison in comparisons(self._references, planes):
            np.maximum(error, comparison.error, out=error)
        return error

    def map_and_pullback(self, test: Array, weight: Array | float) -> tuple[Array, Array]:
        """The map, and the gradient (height, width, 3) of sum(weight * map) with respect to the test pixels.

        Where exposures tie, the lowest one carries the gradient.
        """
        planes = planes_of(test.astype(self.dtype, copy=False))
        error = np.zeros(planes.shape[1:], self.dtype)
        winner = np.full(error.shape, -1, np.int16)
        keep = error.size * self.exposures.count <= _KEPT
        kept: dict[int, FlipComparison] = {}
        for index, comparison in enumerate(comparisons(self._references, planes)):
            larger = comparison.error > error
            if larger.any():
                np.copyto(error, comparison.error, where=larger)
                winner[larger] = index
                if keep:
                    kept[index] = comparison

        def gradient_at(index: int) -> Array:
            comparison = kept.pop(index, None) or self._references[index].compare(planes)
            shown = comparison.pullback(((winner == index) * weight).astype(self.dtype, copy=False))
            return self._curve.pullback(planes, self.exposures.values[index], shown)

        gradient = np.zeros_like(planes)
        for of_one in side_by_side(gradient_at, [index for index in np.unique(winner).tolist() if index >= 0]):
            gradient += of_one
        return error, pixels_of(gradient)


def hdr_flip_map(
    reference: Array,
    test: Array,
    *,
    exposures: ExposureRange | None = None,
    curve: ToneCurve = ToneCurve(),  # noqa: B008  # frozen
    pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE,
) -> Array:
    """HDR-FLIP map (height, width) in [0, 1] of two linear Rec.709 pictures (height, width, 3), in the official range.

    The pooled value is the mean of the map. The range comes from the reference, so the order of the two matters.
    Computed in float64 and returned in float32, as `flip_map`.
    """
    check_pair(reference, test)
    planes = [planes_of(image.astype(np.float64)) for image in (reference, test)]
    exposures = exposures or official_exposures(reference.astype(np.float64), curve)
    error = np.zeros(planes[0].shape[1:])
    for ev in exposures.values:  # nothing is kept of an exposure, of which there may be many
        shown = [curve.apply(image, ev) for image in planes]
        np.maximum(error, FlipReference(shown[0], pixels_per_degree).compare(shown[1]).error, out=error)
    return error.astype(np.float32)
