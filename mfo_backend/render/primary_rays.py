# SPDX-License-Identifier: Apache-2.0
"""Camera rays on a fixed, stratified set of positions in every pixel."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..material.own_memory import own_memory

TILE = 4  # pixels; a tile is the smallest residual when the recording itself is noisy


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
    """Flat pixel indices ordered by tile, and the tile number of each; of every `stride`-th tile along both axes."""
    row, column = np.divmod(np.arange(width * height), width)
    tile_row, tile_column = row // TILE, column // TILE
    tile = tile_row * -(-width // TILE) + tile_column
    kept = np.flatnonzero((tile_row % stride == stride // 2) & (tile_column % stride == stride // 2))
    order = kept[np.argsort(tile[kept], kind="stable")]
    return order, tile[order]


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


def primary_rays(
    sensor: mi.Sensor,
    grid: NDArray[np.int64],
    seed: int,
    stride: int = 1,
    only: NDArray[np.bool_] | None = None,
) -> PrimaryRays:
    """Camera rays, `grid` (height, width) squared a pixel, 0 for none, in every `stride`-th tile along both axes.

    With `only` (height, width) the other pixels have none.
    """
    film = sensor.film()
    width, height = (int(v) for v in film.crop_size())
    order, tile = tile_order(width, height, stride)
    if only is not None:
        kept = only.reshape(-1)[order]
        order, tile = order[kept], tile[kept]
    per_axis = grid.reshape(-1)[order]
    position = own_memory(np.repeat(np.arange(len(order)), per_axis**2), mi.UInt32)
    first = own_memory(np.concatenate([[0], np.cumsum(per_axis**2)[:-1]]), mi.UInt32)
    count = dr.width(position)
    # lanes past the end read 0, and an integer division by 0 kills the process
    cells = dr.maximum(dr.gather(mi.UInt32, own_memory(per_axis, mi.UInt32), position), 1)
    cell = dr.arange(mi.UInt32, count) - dr.gather(mi.UInt32, first, position)
    sampler = fresh_sampler(seed, count)
    flat = dr.gather(mi.UInt32, own_memory(order, mi.UInt32), position)
    y = flat // width
    x = flat - y * width
    cell_y = cell // cells
    # cell centres: exact for a linear change within the pixel, where jittered positions leave a noise of half a per
    # cent
    inside = (mi.Point2f(mi.Float(cell - cell_y * cells), mi.Float(cell_y)) + 0.5) / mi.Float(cells)
    offset, sign = through_filter(film.rfilter(), inside)
    weight = 1.0 / mi.Float(cells * cells)
    if sign is not None:
        total = dr.zeros(mi.Float, len(order))
        dr.scatter_reduce(dr.ReduceOp.Add, total, sign, position)
        weight = sign / dr.gather(mi.Float, total, position)
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
