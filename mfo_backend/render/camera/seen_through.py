# SPDX-License-Identifier: Apache-2.0
"""Which pixels see a shape, and which do behind nothing but what light goes through: glass, and what is cut out.

Shapes whose attribute `SEEN_OTHERWISE` is 1 Cycles shows the camera otherwise: holdouts, shadow catchers, and what
Light Path makes another material to it.

Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..random_numbers.path_random import PathRandom
from ..transport.camera_view import CameraView
from ..transport.ray_starts import RayStarts
from ..transport.smooth_facets import shape_number, shape_table
from .sensor_rays import sensor_ray

MASK_RAYS = 4  # rays per pixel and axis that look for the target
PLASTIC = (0.7548776662466927, 0.5698402909980532)  # steps of the R2 sequence (Roberts 2018): even over a lens
MOST_SURFACES = 16  # that a ray goes through: a bottle in a case of panes is eight. No measurement
SEEN_OTHERWISE = "seen_otherwise"
CLEAR = mi.BSDFFlags.Null | mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.DeltaTransmission


def seen_pixels(scene: mi.Scene, sensor: mi.Sensor, shape: mi.Shape) -> tuple[NDArray[np.bool_], bool]:
    """The pixels (height, width) that see a shape by a regular grid of rays, and whether through others alone."""
    ray, pixels_of = _grid(sensor)
    target = mi.ShapePtr(shape)
    dr.make_opaque(target)  # its number in this process is no part of the kernel
    surface = CameraView(scene).met(ray)
    mask = pixels_of(surface.is_valid() & (surface.shape == target))
    if mask.any():
        return mask, False
    mask = pixels_of(seen_through(scene, target, ray))
    return mask, bool(mask.any())


def otherwise_pixels(scene: mi.Scene, sensor: mi.Sensor) -> NDArray[np.bool_]:
    """The pixels (height, width) that see what Cycles shows them otherwise."""
    shown = [shape for shape in scene.shapes() if shape_number(shape, SEEN_OTHERWISE) == 1.0]
    if not shown:
        width, height = (int(n) for n in sensor.film().crop_size())
        return np.zeros((height, width), bool)
    ray, pixels_of = _grid(sensor)
    surface, table = CameraView(scene).met(ray), shape_table(shown, [1] * len(shown), mi.UInt32)
    number = dr.reinterpret_array(mi.UInt32, surface.shape)
    known = surface.is_valid() & (number < dr.opaque(mi.UInt32, dr.width(table)))
    return pixels_of(known & (dr.gather(mi.UInt32, table, number, known) == 1))


def _grid(sensor: mi.Sensor) -> tuple[mi.Ray3f, Callable[[Any], NDArray[np.bool_]]]:
    """A regular grid of rays in every pixel, and the pixels (height, width) of those for which something holds."""
    width, height = (int(n) for n in sensor.film().crop_size())
    # one pixel's rays follow each other: the nearer the rays of a packet, the quicker
    number, columns = dr.arange(mi.UInt32, MASK_RAYS**2 * width * height), dr.opaque(mi.UInt32, width)
    pixel, of_pixel = number // MASK_RAYS**2, number % MASK_RAYS**2
    corner = mi.Point2f(pixel % columns, pixel // columns)
    within = mi.Point2f(of_pixel % MASK_RAYS, of_pixel // MASK_RAYS)
    position = (corner + (within + 0.5) / MASK_RAYS) / dr.opaque(mi.Point2f, (width, height))
    on_lens = mi.Point2f(0.5)
    if sensor.needs_aperture_sample():  # those of a pixel lie apart on it
        along = (0.5 + mi.Float(of_pixel) * step for step in PLASTIC)
        on_lens = mi.Point2f(*(number - dr.floor(number) for number in along))

    def pixels_of(hit: Any) -> NDArray[np.bool_]:
        seen = dr.zeros(mi.UInt32, width * height)
        dr.scatter(seen, mi.UInt32(1), pixel, hit)
        return seen.numpy().reshape(height, width) > 0

    return sensor_ray(sensor, position, on_lens), pixels_of


def seen_through(scene: mi.Scene, target: mi.ShapePtr, ray: mi.Ray3f) -> mi.Bool:
    """Whether rays of the camera, one path of each drawn by chance, end on the target."""
    random = PathRandom.of(dr.arange(mi.UInt32, dr.width(ray)), mi.UInt32(0))
    return _found(scene, target, mi.Ray3f(ray), CameraView(scene), RayStarts(scene), random.pair)


@dr.syntax
def _found(
    scene: mi.Scene,
    target: mi.ShapePtr,
    ray: mi.Ray3f,
    view: CameraView,
    starts: RayStarts,
    pair: Callable[[mi.UInt32], mi.Point2f],
) -> mi.Bool:
    context, number = mi.BSDFContext(), mi.UInt32(0)
    on_target, active = mi.Bool(False), mi.Bool(True)
    while dr.hint(active, label="seen through glass"):
        si = view.met(ray, active).compute_surface_interaction(ray, mi.RayFlags.All, active)
        active &= si.is_valid()
        on_target |= active & (si.shape == target)
        active &= (si.shape != target) & (number < MOST_SURFACES)
        bs, _ = si.bsdf().sample(context, si, pair(2 * number).x, pair(2 * number + 1), active)
        active &= (bs.pdf > 0) & ((bs.sampled_type & CLEAR) != 0)
        ray = starts.ray(si, si.to_world(bs.wo))
        number += 1
    return on_target
