# SPDX-License-Identifier: Apache-2.0
"""Camera rays on a fixed, stratified set of positions in every pixel."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from .pixel_cells import PixelCells
from .sensor_rays import sensor_ray

TILE = 4  # pixels along each side
# Row and column of a tile's pixels, quarter by quarter
_WITHIN = np.indices((TILE, TILE)).reshape(2, 2, TILE // 2, 2, TILE // 2).swapaxes(2, 3).reshape(2, TILE**2)


def tile_order(width: int, height: int, stride: int = 1) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Flat pixel indices ordered by tile, and the tile number of each; of every `stride`-th tile along both axes.

    Within a tile they are ordered by its quarters, so that those are runs of pixels, too.
    """
    tile_row, tile_column = (np.arange(stride // 2, -(-n // TILE), stride) for n in (height, width))
    row, column = tile_row[:, None, None] * TILE + _WITHIN[0], tile_column[:, None] * TILE + _WITHIN[1]
    inside = (row < height) & (column < width)
    tile = tile_row[:, None, None] * -(-width // TILE) + tile_column[:, None]
    return (row * width + column)[inside], np.broadcast_to(tile, inside.shape)[inside]


def quarter(pixel: NDArray[np.int64], width: int) -> NDArray[np.int64]:
    """Which quarter of its tile each pixel lies in, 0 to 3."""
    row, column = np.divmod(pixel, width)
    half = TILE // 2
    return 2 * (row % TILE // half) + column % TILE // half


def fresh_sampler(seed: int, width: int) -> mi.Sampler:
    """Independent random numbers; the seed is data, so that another seed needs no other kernel."""
    sampler = mi.load_dict({"type": "independent", "sample_count": 1})
    sampler.seed(dr.opaque(mi.UInt32, seed), width)
    return sampler


# of a cell's centre to the points of Gauss and Legendre, in sides: exact for a cubic change within the cell
GAUSS = 0.5 / math.sqrt(3.0)


class PrimaryRays:
    """A camera ray through the centre of each cell, or `four` one after the other through its Gauss points.

    Positions follow the film's reconstruction filter (M. Ernst et al., "Filter Importance Sampling", 2006), so every
    ray counts alike and the expected pixel equals the splatted one; a filter's negative parts carry a negative weight.
    Nothing is kept for each ray but its point on a lens: all else is computed from the cells wherever it is asked for.

    Parameters
    ----------
    order, tile
        Those of `tile_order`: `cells` count pixels in this order.
    seed
        Of the points on a lens.

    Attributes
    ----------
    pixel, tile
        Flat index of each pixel and the number of its tile.
    """

    def __init__(
        self,
        sensor: mi.Sensor,
        cells: PixelCells,
        order: NDArray[np.int64],
        tile: NDArray[np.int64],
        seed: int,
        *,
        four: bool = False,
    ) -> None:
        self.pixel, self.tile = order, tile
        self._sensor, self._four, self._each = sensor, four, 4 if four else 1
        self._count = self._each * len(cells)
        self._flat = own_memory(order, mi.UInt32)
        self._position = own_memory(cells.position, mi.UInt32)
        self._side, self._x, self._y = (own_memory(a, mi.Float) for a in (cells.side, cells.x, cells.y))
        self._through = through_filter(sensor.film().rfilter())
        self._on_lens = fresh_sampler(seed, self._count).next_2d() if sensor.needs_aperture_sample() else None
        self._total: mi.Float | None = None  # of a pixel's weights, where a filter gives them signs
        if self._through(mi.Point2f(0.5))[1] is not None:
            number, self._total = dr.arange(mi.UInt32, self._count), dr.zeros(mi.Float, len(order))
            dr.scatter_reduce(dr.ReduceOp.Add, self._total, self._own_weight(number), self.position(number))
        dr.eval(self._on_lens, self._total)

    def __len__(self) -> int:
        return self._count

    def position(self, number: mi.UInt32) -> mi.UInt32:
        """The pixel of each of these rays, counted in tile order."""
        return dr.gather(mi.UInt32, self._position, number // self._each)

    def weight(self, number: mi.UInt32) -> mi.Float:
        """The filter's share of each ray in its pixel; they add up to 1."""
        weight = self._own_weight(number)
        return weight if self._total is None else weight / dr.gather(mi.Float, self._total, self.position(number))

    def ray(self, number: mi.UInt32) -> mi.Ray3f:
        """The rays of these numbers."""
        offset, _ = self._offset(number)
        on_lens = mi.Point2f(0.5) if self._on_lens is None else dr.gather(mi.Point2f, self._on_lens, number)
        flat = dr.gather(mi.UInt32, self._flat, self.position(number))
        return camera_ray(self._sensor, flat, offset, on_lens)

    def _own_weight(self, number: mi.UInt32) -> mi.Float:
        side = dr.gather(mi.Float, self._side, number // self._each)
        _, sign = self._offset(number)
        return side * side / self._each * (1.0 if sign is None else sign)

    def _offset(self, number: mi.UInt32) -> tuple[mi.Point2f, mi.Float | None]:
        """Positions on the film from the pixels' centres, in pixels, and the filter's sign there."""
        cell = number // self._each
        side = dr.gather(mi.Float, self._side, cell)
        corner = mi.Point2f(*(dr.gather(mi.Float, a, cell) for a in (self._x, self._y)))
        # cell centres: exact for a linear change within the pixel, where jittered positions leave a noise of half a
        # per cent
        point = mi.Point2f(0.5)
        if self._four:
            point += GAUSS * mi.Point2f(2.0 * mi.Float(number & 1) - 1.0, mi.Float(number & 2) - 1.0)
        return self._through(corner + side * point)


def camera_ray(sensor: mi.Sensor, pixel: mi.UInt32, offset: mi.Point2f, on_lens: mi.Point2f) -> mi.Ray3f:
    """Rays through positions `offset` pixels away from the centres of pixels, by their flat indices."""
    film = sensor.film()
    width = dr.opaque(mi.UInt32, int(film.crop_size()[0]))  # no part of the kernel
    y = pixel // width
    x = pixel - y * width
    # a sensor counts from 0 to 1 along the part of its film that is rendered
    on_film = mi.Point2f(mi.Float(x) + offset.x + 0.5, mi.Float(y) + offset.y + 0.5)
    on_film /= dr.opaque(mi.Point2f, tuple(int(n) for n in film.crop_size()))
    return sensor_ray(sensor, on_film, on_lens)


def through_filter(
    rfilter: mi.ReconstructionFilter,
) -> Callable[[mi.Point2f], tuple[mi.Point2f, mi.Float | None]]:
    """What makes of points in the unit square offsets from the pixel centre with density |filter|, and the filter's
    sign there over the mean of its signs, None for a filter without negative parts."""
    if rfilter.is_box_filter():
        return lambda u: (u - 0.5, None)
    edges = np.linspace(-rfilter.radius(), rfilter.radius(), 1025, dtype=np.float32)
    value = np.array(rfilter.eval(own_memory(0.5 * (edges[1:] + edges[:-1]), mi.Float)))
    cumulative = np.concatenate([[0.0], np.cumsum(np.abs(value))])
    mean = 1.0 if (value >= 0.0).all() else float(value.sum() / cumulative[-1])  # of the signs along an axis
    quantiles = own_memory(np.interp(np.linspace(0, 1, 4097), cumulative / cumulative[-1], edges), mi.Float)

    def inverse(t: mi.Float) -> mi.Float:
        cell = dr.minimum(mi.UInt32(t * 4096.0), 4095)
        low, high = dr.gather(mi.Float, quantiles, cell), dr.gather(mi.Float, quantiles, cell + 1)
        return dr.lerp(low, high, t * 4096.0 - mi.Float(cell))

    def offset(u: mi.Point2f) -> tuple[mi.Point2f, mi.Float | None]:
        away = mi.Point2f(inverse(u.x), inverse(u.y))
        return away, None if mean == 1.0 else dr.sign(rfilter.eval(away.x) * rfilter.eval(away.y)) / mean**2

    return offset
