# SPDX-License-Identifier: Apache-2.0
"""Which pixels see a shape, and which do behind nothing but what light goes through: glass, and what is cut out.

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
from .sensor_rays import sensor_ray

MASK_RAYS = 4  # rays per pixel and axis that look for the target
PLASTIC = (0.7548776662466927, 0.5698402909980532)  # steps of the R2 sequence (Roberts 2018): even over a lens
MOST_SURFACES = 16  # that a ray goes through: a bottle in a case of panes is eight. No measurement
CLEAR = mi.BSDFFlags.Null | mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.DeltaTransmission


def seen_pixels(scene: mi.Scene, sensor: mi.Sensor, shape: mi.Shape) -> tuple[NDArray[np.bool_], bool]:
    """The pixels (height, width) that see a shape by a regular grid of rays, and whether through others alone."""
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
    ray = sensor_ray(sensor, position, on_lens)
    target = mi.ShapePtr(shape)
    dr.make_opaque(target)  # its number in this process is no part of the kernel

    def pixels_of(hit: Any) -> NDArray[np.bool_]:
        seen = dr.zeros(mi.UInt32, width * height)
        dr.scatter(seen, mi.UInt32(1), pixel, hit)
        return seen.numpy().reshape(height, width) > 0

    surface = CameraView(scene).met(ray)
    mask = pixels_of(surface.is_valid() & (surface.shape == target))
    if mask.any():
        return mask, False
    mask = pixels_of(seen_through(scene, target, ray))
    return mask, bool(mask.any())


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
