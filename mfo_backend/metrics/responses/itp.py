# SPDX-License-Identifier: Apache-2.0
"""dE_ITP: colour difference of high dynamic range pictures in just noticeable differences.

References
----------
Recommendation ITU-R BT.2124-0 (2019); ICtCp and the PQ curve are those of BT.2100, the matrix to BT.2020 is that of
BT.2087.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

_BT709_TO_BT2020 = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
_BT2020_TO_LMS = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
_RGB_TO_LMS = _BT2020_TO_LMS @ _BT709_TO_BT2020
_PQ_TO_ICTCP = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096
# T is half of Ct, and a distance of 1/720 is one just noticeable difference (BT.2124, equation 1)
_PQ_TO_JND = 720 * np.diag([1.0, 0.5, 1.0]) @ _PQ_TO_ICTCP

_M1, _M2 = 2610 / 16384, 2523 / 32
_C1, _C2, _C3 = 3424 / 4096, 2413 / 128, 2392 / 128
_PEAK = 10000.0  # cd/m^2
_DARKEST = 1e-9  # of the peak: the curve's slope is infinite at 0


@dataclass(frozen=True)
class Itp:
    """I, T and P in units of just noticeable differences, with `nits` cd/m^2 for a radiance of 1.

    The Euclidean distance of two responses is dE_ITP. Negative radiance counts as 0.
    """

    nits: float

    def apply(self, linear: Array) -> Array:
        """See `Response`."""
        return _pq(self._cone(linear)) @ _typed(_PQ_TO_JND.T, linear)

    def pullback(self, linear: Array, gradient: Array) -> Array:
        """See `Response`."""
        pulled = gradient @ _typed(_PQ_TO_JND, linear)
        return (pulled * _pq_slope(self._cone(linear))) @ self._matrix(linear).T * (linear >= 0)

    def push(self, linear: Array, tangent: Array) -> Array:
        """See `Response`."""
        pushed = (tangent * (linear >= 0)) @ self._matrix(linear)
        return (pushed * _pq_slope(self._cone(linear))) @ _typed(_PQ_TO_JND.T, linear)

    def _matrix(self, linear: Array) -> Array:
        return _typed(_RGB_TO_LMS.T * (self.nits / _PEAK), linear)

    def _cone(self, linear: Array) -> Array:
        return np.maximum(linear, 0) @ self._matrix(linear)


def de_itp_map(reference: Array, test: Array, nits: float = 1.0) -> Array:
    """dE_ITP (height, width) of two linear Rec.709 pictures, with `nits` cd/m^2 for a value of 1.

    A difference of 1 is just noticeable.
    """
    response = Itp(nits)
    difference = response.apply(test) - response.apply(reference)
    return np.sqrt(np.square(difference).sum(axis=-1))


def _typed(matrix: Array, like: Array) -> Array:
    return matrix.astype(like.dtype)


def _pq(cone: Array) -> Array:
    power = np.clip(cone, _DARKEST, 1) ** _M1
    return ((_C1 + _C2 * power) / (1 + _C3 * power)) ** _M2


def _pq_slope(cone: Array) -> Array:
    clipped = np.clip(cone, _DARKEST, 1)
    power = clipped**_M1
    numerator, denominator = _C1 + _C2 * power, 1 + _C3 * power
    ratio_slope = (_C2 - _C1 * _C3) / np.square(denominator) * _M1 * power / clipped
    slope = _M2 * (numerator / denominator) ** (_M2 - 1) * ratio_slope
    return slope * ((cone >= _DARKEST) & (cone <= 1))
