# SPDX-License-Identifier: Apache-2.0
"""The low-pass and feature filters of FLIP with their adjoints, separable.

References
----------
Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020, sections 4.1 and 4.2.
Andersson et al., "Supplement to FLIP: separated convolutions" (NVlabs/flip, misc/separatedConvolutions.pdf).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..pixels.banded_filter import BandedFilter

Array = NDArray[np.floating]

# A 0.7 m wide 3840 pixel monitor seen from 0.7 m, the default of all FLIP implementations
DEFAULT_PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * np.pi / 180

# Contrast sensitivity as sums of Gaussians a sqrt(pi/b) exp(-pi^2 d^2 / b), d in degrees (HPG 2020, table 1)
_CSF = {"Y": [(1.0, 0.0047)], "Cx": [(1.0, 0.0053)], "Cz": [(34.1, 0.04), (13.5, 0.025)]}
_CSF_WIDEST_B = 0.04
_FEATURE_WIDTH_DEGREES = 0.082  # HPG 2020, section 4.2: the edge detector's peak-to-trough distance


def csf_profiles(channel: str, pixels_per_degree: float) -> list[Array]:
    """One-dimensional profiles p_i of a channel's low-pass; the filter is the sum of the outer products p_i p_i^T."""
    radius = int(np.ceil(3 * np.sqrt(_CSF_WIDEST_B / (2 * np.pi**2)) * pixels_per_degree))
    degrees = np.arange(-radius, radius + 1) / pixels_per_degree
    profiles = [np.sqrt(a * np.sqrt(np.pi / b)) * np.exp(-(np.pi**2) * degrees**2 / b) for a, b in _CSF[channel]]
    norm = np.sqrt(sum(p.sum() ** 2 for p in profiles))
    return [p / norm for p in profiles]


def flip_reach(pixels_per_degree: float) -> int:
    """Pixels to either side that an error depends on."""
    return max(len(csf_profiles("Cz", pixels_per_degree)[0]), len(feature_profiles(pixels_per_degree)[0])) // 2


def feature_profiles(pixels_per_degree: float) -> tuple[Array, Array, Array]:
    """Gaussian, its first and its second derivative; positive weights sum to 1, negative ones to -1."""
    sigma = 0.5 * _FEATURE_WIDTH_DEGREES * pixels_per_degree
    radius = int(np.ceil(3 * sigma))
    x: Array = np.arange(-radius, radius + 1).astype(np.float64)
    gauss = np.exp(-(x**2) / (2 * sigma**2))
    edge = _balanced(-x * gauss)
    point = _balanced((x**2 / sigma**2 - 1) * gauss)
    return gauss / gauss.sum(), edge, point


def _balanced(kernel: Array) -> Array:
    positive, negative = np.maximum(kernel, 0), np.maximum(-kernel, 0)
    return positive / max(positive.sum(), 1e-30) - negative / max(negative.sum(), 1e-30)


class FlipFilters:
    """The filters for one image size; planes are (height, width)."""

    def __init__(self, height: int, width: int, pixels_per_degree: float, dtype: np.dtype) -> None:
        down, across = (_line_filters(length, pixels_per_degree, dtype) for length in (height, width))
        luma, red_green, yellow_blue, yellow_blue_narrow, *features = zip(down, across, strict=True)
        self._csf = [[luma], [red_green], [yellow_blue, yellow_blue_narrow]]
        self._gauss, self._edge, self._point = features

    def low_pass(self, planes: Array) -> Array:
        """The opponent planes (3, height, width) as the eye resolves them."""
        out = np.empty_like(planes)
        for channel, filters in enumerate(self._csf):
            out[channel] = sum(x.along_x(y.along_y(planes[channel])) for y, x in filters)
        return out

    def low_pass_adjoint(self, planes: Array) -> Array:
        """The transpose of `low_pass`."""
        out = np.empty_like(planes)
        for channel, filters in enumerate(self._csf):
            out[channel] = sum(y.adjoint_along_y(x.adjoint_along_x(planes[channel])) for y, x in filters)
        return out

    def features(self, plane: Array) -> Array:
        """Edge along x, edge along y, point along x, point along y: (4, height, width)."""
        (gauss_y, gauss_x), (edge_y, edge_x), (point_y, point_x) = self._gauss, self._edge, self._point
        smooth = gauss_y.along_y(plane)
        return np.stack(
            [
                edge_x.along_x(smooth),
                gauss_x.along_x(edge_y.along_y(plane)),
                point_x.along_x(smooth),
                gauss_x.along_x(point_y.along_y(plane)),
            ]
        )

    def features_adjoint(self, features: Array) -> Array:
        """The transpose of `features`: one plane."""
        (gauss_y, gauss_x), (edge_y, edge_x), (point_y, point_x) = self._gauss, self._edge, self._point
        smooth = edge_x.adjoint_along_x(features[0]) + point_x.adjoint_along_x(features[2])
        out = gauss_y.adjoint_along_y(smooth)
        out += edge_y.adjoint_along_y(gauss_x.adjoint_along_x(features[1]))
        out += point_y.adjoint_along_y(gauss_x.adjoint_along_x(features[3]))
        return out


@lru_cache(maxsize=64)
def _line_filters(length: int, pixels_per_degree: float, dtype: np.dtype) -> list[BandedFilter]:
    """The low-passes of Y, Cx and twice Cz, then Gaussian, edge and point, for lines of `length` pixels."""
    kernels = [profile for channel in _CSF for profile in csf_profiles(channel, pixels_per_degree)]
    return [BandedFilter(k, length, dtype) for k in (*kernels, *feature_profiles(pixels_per_degree))]


@lru_cache(maxsize=64)
def flip_filters(height: int, width: int, pixels_per_degree: float, dtype: np.dtype) -> FlipFilters:
    """The filters of a size, built once."""
    return FlipFilters(height, width, pixels_per_degree, dtype)
