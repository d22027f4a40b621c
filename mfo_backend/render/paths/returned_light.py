# SPDX-License-Identifier: Apache-2.0
"""How light that the target has reflected before changes with its material.

A path over other surfaces that has met the target before carries its albedo as a factor, once for each time. A lane of
weight w keeps the part P of it that the target has reflected at least once, a recording how often, m, in the mean. With
the albedo a(x) of a material, and a(x_0) of that of the recording, the weight is

    w(x) = w + P ((a(x) / a(x_0))^m - 1)

channel by channel. It is exact where all of P was reflected equally often by one albedo for all directions; elsewhere
its slope by the albedo is right in the mean. What comes through the target to other places of it is taken as known.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from ..models.varying_values import SHAPE
from ..random_numbers.even_points import even_points
from .packed_lanes import Lanes
from .proposal import DefensiveProposal
from .recorded_jacobian import RecordedJacobian
from .recorded_paths import LaneGroups, RecordedPaths

# Pairs of directions, at as many places; 0.2 ms of processor time, so fewer save nothing. No measurement of its noise,
# which is the same for all materials
ALBEDO_LANES = 4096
GEOMETRIC = SHAPE[0]
LEAST_ALBEDO = 1e-4  # for a division: what a blacker target reflects shows nothing


class ReturnedGrowth:
    """The factor (a(x) / a(x_0))^m of a recording's light that returns, with derivatives where an image has them.

    The albedo is that for light from all sides: a mean over pairs of directions, and over places of the recording.
    """

    def __init__(self, paths: RecordedPaths, held: Sequence[str]) -> None:
        self._known: NDArray[np.float64] | None = None
        self._order = None if paths.returned is None else paths.returned.order[:, None]
        if paths.returned is not None:
            self._share, self._vector = paths.returned.share, paths.vector
            self._lanes, self._group = _albedo_lanes(paths, held)

    def __call__(
        self, image: RecordedJacobian, vector: NDArray[np.float64], pictures: tuple[Any, ...] | None = None
    ) -> tuple[mi.Float, ...]:
        """The factor and its derivatives, 3 (1 + K) numbers channel by channel, or nothing where no light returns.

        `pictures` may stand in for those that a graph gives at the vector.
        """
        factor = self._factor(image, vector, pictures)
        return () if factor is None else (own_memory(factor.ravel(), mi.Float),)

    def change(self, image: RecordedJacobian, vector: NDArray[np.float64]) -> float:
        """The part of all light by which what returns has changed, in the channel where it is most."""
        factor = self._factor(image, vector, None)
        return 0.0 if factor is None else float(np.max(self._share * np.abs(factor[:, 0] - 1.0)))

    def _factor(
        self, image: RecordedJacobian, vector: NDArray[np.float64], pictures: tuple[Any, ...] | None
    ) -> NDArray[np.float64] | None:
        """The factor of each channel and its derivatives, (3, 1 + K)."""
        if self._order is None:
            return None
        if self._known is None:
            self._known = np.maximum(self._albedo(image, self._vector, None)[:, :1], LEAST_ALBEDO)
        ratio = self._albedo(image, vector, pictures) / self._known
        here = np.maximum(ratio[:, :1], LEAST_ALBEDO)
        return np.concatenate([here**self._order, self._order * here ** (self._order - 1.0) * ratio[:, 1:]], axis=1)

    def _albedo(
        self, image: RecordedJacobian, vector: NDArray[np.float64], pictures: tuple[Any, ...] | None
    ) -> NDArray[np.float64]:
        """The albedo of each channel and its derivatives, (3, 1 + K)."""
        as_it_is = own_memory(np.eye(1, image.width).repeat(3, axis=0).ravel(), mi.Float)
        return image(vector, self._lanes, self._group, pictures, (as_it_is,))[0, 0].astype(np.float64)


def _albedo_lanes(paths: RecordedPaths, held: Sequence[str]) -> tuple[Lanes, LaneGroups]:
    """Lanes whose sum is an albedo, with values that textures give at evenly spread lanes of a recording.

    No light returns in them, and their kernel is that of lanes where some does.
    """
    number, zero = dr.arange(mi.UInt32, ALBEDO_LANES), dr.zeros(mi.UInt32, ALBEDO_LANES)
    wi = mi.warp.square_to_cosine_hemisphere(mi.Point2f(*even_points(2, number, zero, 1, 0)))
    lobe, *u = even_points(3, number, zero, 1, 1)
    proposal = DefensiveProposal()
    wo = proposal.sample(wi, lobe, mi.Point2f(*u))
    density = proposal.density(wi, wo)
    likely = dr.select(density > 0.0, ALBEDO_LANES * density, dr.inf)
    # an array for each channel, as in recordings: one for all would be another kernel
    weight, nothing = (mi.Color3f(*(dr.opaque(mi.Float, n) / likely for _ in range(3))) for n in (1.0, 0.0))
    place = own_memory(np.linspace(0, paths.lanes - 1, ALBEDO_LANES).astype(np.uint32), mi.UInt32)
    values = tuple(dr.gather(type(paths.held[name]), paths.held[name], place) for name in held)
    by_name = dict(zip(held, values, strict=True))
    if GEOMETRIC in by_name:  # no ray comes from below a face, and normals that are bent to views have no value there
        face = by_name[GEOMETRIC]
        wi = dr.select(dr.dot(wi, face) < 0.0, wi - 2.0 * dr.dot(wi, face) * face, wi)
    dr.eval(wi, wo, weight, values, nothing)
    first = np.zeros(1, np.int64)
    group = LaneGroups(first, np.arange(2), first, np.array([[0, ALBEDO_LANES]]))
    start, stop, _ = group.parts
    return Lanes((wi, wo, weight, *values, nothing), start, stop, dr.opaque(mi.UInt32, 1)), group
