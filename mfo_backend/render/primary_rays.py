# SPDX-License-Identifier: Apache-2.0
"""Camera rays on a fixed, stratified set of positions in every pixel."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..material.own_memory import own_memory
from .pixel_cells import PixelCells

TILE = 4  # pixels along each side


@dataclass(frozen=True)
class PrimaryRays:
    """Rays for each pixel, pixels in tile order; `pixel_position` counts in that order.

    Positions follow the film's reconstruction filter (M. Ernst et al., "Filter Importance Sampling", 2006), so every
    ray counts alike and the expected pixel equals the splatted one; a filter's negative parts carry a negative weight.
    `filter_weight` adds up to 1 within a pixel.
    """

    ray: mi.Ray3f
    pixel_position: mi.UInt32
    filter_weight: mi.Float
    pixel: NDArray[np.int64]
    tile: NDArray[np.int64]


def tile_order(width: int, height: int, stride: int = 1) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Flat pixel indices ordered by tile, and the tile number of each; of every `stride`-th tile along both axes.

    Within a tile they are ordered by its quarters, so that those are runs of pixels, too.
    """
    row, column = np.divmod(np.arange(width * height), width)
    tile_row, tile_column = row // TILE, column // TILE
    tile = tile_row * -(-width // TILE) + tile_column
    kept = np.flatnonzero((tile_row % stride == stride // 2) & (tile_column % stride == stride // 2))
    order = kept[np.argsort(4 * tile[kept] + quarter(kept, width), kind="stable")]
    return order, tile[order]


def quarter(pixel: NDArray[np.int64], width: int) -> NDArray[np.int64]:
    """Which quarter of its tile each pixel lies in, 0 to 3."""
    row, column = np.divmod(pixel, width)
    half = TILE // 2
    return 2 * (row % TILE // half) + column % TILE // half


def widened(mask: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """`mask` (height, width) with every pixel that is at most `pixels` away along each axis.

    As SciPy's `binary_dilation`, whose package takes a tenth of a second to import.
    """
    for axis, size in enumerate(mask.shape):
        padded = np.pad(mask, [(pixels, pixels) if a == axis else (0, 0) for a in (0, 1)])
        mask = np.logical_or.reduce([padded.take(range(k, k + size), axis) for k in range(2 * pixels + 1)])
    return mask


def fresh_sampler(seed: int, width: int) -> mi.Sampler:
    """Independent random numbers; the seed is data, so that another seed needs no other kernel."""
    sampler = mi.load_dict({"type": "independent", "sample_count": 1})
    sampler.seed(dr.opaque(mi.UInt32, seed), width)
    return sampler


# of a cell's centre to the points of Gauss and Legendre, in sides: exact for a cubic change within the cell
GAUSS = 0.5 / math.sqrt(3.0)


def primary_rays(
    sensor: mi.Sensor,
    cells: PixelCells,
    order: NDArray[np.int64],
    tile: NDArray[np.int64],
    seed: int,
    *,
    four: bool = False,
) -> PrimaryRays:
    """A camera ray through the centre of each cell, or `four` one after the other through its Gauss points.

    `order` and `tile` are those of `tile_order`.
    """
    film = sensor.film()
    width = int(film.crop_size()[0])
    each = 4 if four else 1
    count = each * len(cells)
    number = dr.arange(mi.UInt32, count)
    cell = number // each
    position = dr.gather(mi.UInt32, own_memory(cells.position, mi.UInt32), cell)
    side = dr.gather(mi.Float, own_memory(cells.side, mi.Float), cell)
    corner = mi.Point2f(*(dr.gather(mi.Float, own_memory(a, mi.Float), cell) for a in (cells.x, cells.y)))
    sampler = fresh_sampler(seed, count)
    flat = dr.gather(mi.UInt32, own_memory(order, mi.UInt32), position)
    y = flat // width
    x = flat - y * width
    # cell centres: exact for a linear change within the pixel, where jittered positions leave a noise of half a per
    # cent
    point = mi.Point2f(0.5)
    if four:
        point += GAUSS * mi.Point2f(2.0 * mi.Float(number & 1) - 1.0, mi.Float(number & 2) - 1.0)
    offset, sign = through_filter(film.rfilter(), corner + side * point)
    weight = side * side / each
    if sign is not None:
        weight *= sign
        total = dr.zeros(mi.Float, len(order))
        dr.scatter_reduce(dr.ReduceOp.Add, total, weight, position)
        weight /= dr.gather(mi.Float, total, position)
    crop = film.crop_offset()
    size = mi.ScalarVector2f(film.size())
    film_position = mi.Point2f(
        mi.Float(x) + offset.x + 0.5 + crop[0], mi.Float(y) + offset.y + 0.5 + crop[1]
    ) / mi.Point2f(size)
    ray, _ = sensor.sample_ray(0.5 * sensor.shutter_open_time(), 0.5, film_position, sampler.next_2d())
    return PrimaryRays(ray, position, weight, order, tile)


def through_filter(rfilter: mi.ReconstructionFilter, u: mi.Point2f) -> tuple[mi.Point2f, mi.Float | None]:
    """Offsets from the pixel centre with density |filter|, and the filter's sign where it has one."""
    if rfilter.is_box_filter():
        return u - 0.5, None
    edges = np.linspace(-rfilter.radius(), rfilter.radius(), 1025, dtype=np.float32)
    value = np.array(rfilter.eval(own_memory(0.5 * (edges[1:] + edges[:-1]), mi.Float)))
    cumulative = np.concatenate([[0.0], np.cumsum(np.abs(value))])
    quantiles = own_memory(np.interp(np.linspace(0, 1, 4097), cumulative / cumulative[-1], edges), mi.Float)

    def inverse(t: mi.Float) -> mi.Float:
        cell = dr.minimum(mi.UInt32(t * 4096.0), 4095)
        low, high = dr.gather(mi.Float, quantiles, cell), dr.gather(mi.Float, quantiles, cell + 1)
        return dr.lerp(low, high, t * 4096.0 - mi.Float(cell))

    offset = mi.Point2f(inverse(u.x), inverse(u.y))
    if (value >= 0.0).all():
        return offset, None
    return offset, dr.sign(rfilter.eval(offset.x) * rfilter.eval(offset.y))
