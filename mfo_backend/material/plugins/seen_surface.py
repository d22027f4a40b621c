# SPDX-License-Identifier: Apache-2.0
"""Which subpixel of a camera's picture shows a point of a surface."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportReturnType=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..arrays.own_memory import own_memory

NOWHERE = 0xFFFFFFFF
RINGS = 2  # subpixels beside the surface that take their neighbours' value: samples may miss what a ray meets
BESIDE = 8  # subpixels beside the picture that take the value of the nearest one in it: two pixels of the finest
# A point is seen where it is as near to what the camera saw there as neighbours are to each other, twice, or as this
# share of the surface's extent
NEAR_NEIGHBOURS, NEAR_EXTENT = 2.0, 1e-3
# Cosine to the direction of the camera above which a ray counts as the camera's: 2.6 degrees, for a lens has a width;
# of all other rays 0.1 % are as near to it
FROM_CAMERA = 0.999
PARALLEL = 1e-9  # w of a camera with parallel rays, which rounding leaves, by the length of the rest


class SeenSurface:
    """Which subpixel shows a point, for all textures of one surface.

    Of several `depths` there is one picture below the other: what the camera sees, what it would see were that away,
    and so on.
    """

    def __init__(self, positions: NDArray[np.float32], camera: NDArray[np.float64], depths: int = 1) -> None:
        self.rows, self.width = positions.shape[:2]
        self.depths, self.height = depths, self.rows // depths
        pictures = positions.reshape(depths, self.height, self.width, 3)
        seen = np.isfinite(positions).all(axis=2)
        self.seen = seen
        own = [_filled(each) for each in seen.reshape(depths, self.height, self.width)]
        offsets = np.arange(depths) * self.height * self.width
        source = np.concatenate([np.where(each < 0, -1, each + o) for each, o in zip(own, offsets, strict=True)])
        self._source = own_memory(np.where(source < 0, NOWHERE, source), mi.UInt32)
        known = np.where(seen[..., None], positions, 0.0).reshape(-1, 3)[np.maximum(source, 0).ravel()]
        self._positions = own_memory(known, mi.Float)
        extent = np.ptp(positions[seen], axis=0) if seen.any() else np.zeros(3)
        steps = np.concatenate([_steps(each) for each in pictures])
        reach = NEAR_NEIGHBOURS * steps + NEAR_EXTENT * float(np.linalg.norm(extent))
        self._reach = own_memory(reach.ravel()[np.maximum(source, 0).ravel()], mi.Float)
        self._eye = _eye_of(camera)
        self._camera = [[dr.opaque(mi.Float, float(v)) for v in row] for row in camera]
        dr.eval(self._source, self._positions, self._reach)

    def is_from_camera(self, si: mi.SurfaceInteraction3f) -> mi.Bool:
        """Whether the ray that met the surface came from where the camera is."""
        return dr.dot(si.to_world(si.wi), dr.normalize(self._towards(si))) > FROM_CAMERA

    def is_behind(self, si: mi.SurfaceInteraction3f) -> mi.Bool:
        """Whether the ray met the other side of the surface than the camera would."""
        normal = mi.Vector3f(si.n)
        return dr.dot(normal, self._towards(si)) * dr.dot(normal, si.to_world(si.wi)) < 0

    def _towards(self, si: mi.SurfaceInteraction3f) -> mi.Vector3f:
        """The direction of the camera, of any length."""
        x, y, z, w = (dr.opaque(mi.Float, float(number)) for number in self._eye)
        return mi.Vector3f(x, y, z) - mi.Vector3f(si.p) * w  # parallel rays of an orthographic one: w is 0

    def row_of(self, point: mi.Point3f) -> mi.UInt32:
        """The subpixel that holds the point's value, or the number of them where the camera does not see it."""
        index, seen = self.find(point, mi.Bool(True))
        return dr.select(seen, index, dr.opaque(mi.UInt32, self.rows * self.width))

    def find(self, point: mi.Point3f, active: Any) -> tuple[mi.UInt32, mi.Bool]:
        """The subpixel that holds the point's value, and whether the camera sees the point."""
        column, row, w = (r[0] * point.x + r[1] * point.y + r[2] * point.z + r[3] for r in self._camera)
        inverse = dr.rcp(w)
        column, row = dr.floor(column * inverse), dr.floor(row * inverse)
        width, height = dr.opaque(mi.Float, self.width), dr.opaque(mi.Float, self.height)
        # pixels at the picture's edge show what their filter finds beside it
        near_column, near_row = dr.clip(column, 0, width - 1), dr.clip(row, 0, height - 1)
        beside = dr.maximum(dr.abs(column - near_column), dr.abs(row - near_row))
        inside = active & (w > 0) & (beside <= BESIDE)
        first = mi.UInt32(dr.select(inside, near_row, 0)) * mi.UInt32(width)
        first += mi.UInt32(dr.select(inside, near_column, 0))
        # at a rim one subpixel holds both sides, each within the other's reach
        source, seen, nearest = self._at(first, point, beside, inside)
        for depth in range(1, self.depths):
            below = dr.opaque(mi.UInt32, depth * self.height * self.width)
            here, is_here, apart = self._at(first + below, point, beside, inside)
            is_nearer = is_here & (~seen | (apart < nearest))
            source, nearest = dr.select(is_nearer, here, source), dr.select(is_nearer, apart, nearest)
            seen |= is_here
        return source, seen

    def _at(
        self, index: mi.UInt32, point: mi.Point3f, beside: mi.Float, active: Any
    ) -> tuple[mi.UInt32, mi.Bool, mi.Float]:
        """The same at one depth, where `index` is the subpixel that the point projects to, or so many `beside` the
        nearest of the picture, and how far from there the camera saw the surface."""
        source = dr.gather(mi.UInt32, self._source, index, active)
        known = active & (source != NOWHERE)
        apart = dr.norm(dr.gather(mi.Point3f, self._positions, index, known) - point)
        return source, known & (apart <= dr.gather(mi.Float, self._reach, index, known) * (1 + beside)), apart


def _eye_of(camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """The homogeneous point that the matrix leads to 0: the camera with a positive w, or the way back to one whose rays
    are parallel, with w 0."""
    eye = np.linalg.svd(camera)[2][3]
    if abs(eye[3]) > PARALLEL * np.linalg.norm(eye[:3]):
        return eye * np.sign(eye[3])
    ahead = np.cross(camera[0, :3], camera[1, :3])  # columns count to the right, rows down
    return -eye * np.sign(eye[:3] @ ahead)


def _filled(seen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The subpixel whose value each takes: its own, a neighbour's some rings away, or -1."""
    source = np.where(seen, np.arange(seen.size).reshape(seen.shape), -1)
    for _ in range(RINGS):
        padded = np.pad(source, 1, constant_values=-1)
        rows, columns = source.shape
        for down in (1, 0, 2):
            for right in (1, 0, 2):
                near = padded[down : down + rows, right : right + columns]
                source = np.where((source < 0) & (near >= 0), near, source)
    return source


def _steps(positions: NDArray[np.float32]) -> NDArray[np.float32]:
    """The largest distance of each position to those of its neighbours above, below and beside it; 0 without."""
    steps = np.zeros(positions.shape[:2], np.float32)
    for axis in (0, 1):
        apart = np.nan_to_num(np.linalg.norm(np.diff(positions, axis=axis), axis=2))
        before = np.pad(apart, [(1, 0) if k == axis else (0, 0) for k in (0, 1)])
        after = np.pad(apart, [(0, 1) if k == axis else (0, 0) for k in (0, 1)])
        steps = np.maximum(steps, np.maximum(before, after))
    return steps
