# SPDX-License-Identifier: Apache-2.0
"""Rays of a camera by kernels that hold for pictures of every size.

Mitsuba's own have the sizes of the film as numbers in their code (3.9: `ADIntegrator.sample_rays`, and where a
perspective camera scales its principal point), so a picture of another size would compile each of them again.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import drjit as dr
import mitsuba as mi


def film_samples(sensor: mi.Sensor, sampler: mi.Sampler) -> tuple[mi.Ray3f, mi.Point2f]:
    """A ray for each sample of each pixel, and where on the film it counts.

    That is at random in its pixel, or in what a narrower filter has of it, under a box filter at its corner. Those of a
    pixel follow each other; random numbers as in `ADIntegrator.sample_rays`.
    """
    film = sensor.film()
    rfilter = film.rfilter()
    border = rfilter.border_size() if film.sample_border() else 0
    width, height = (int(n) + 2 * border for n in film.crop_size())
    samples = sampler.sample_count()
    columns = dr.opaque(mi.UInt32, width)
    pixel = dr.arange(mi.UInt32, width * height * samples) // dr.opaque(mi.UInt32, samples)
    y = pixel // columns
    first = dr.opaque(mi.Point2f, tuple(int(n) - border for n in film.crop_offset()))
    corner = mi.Point2f(mi.Float(pixel - y * columns), mi.Float(y)) + first
    place = corner + sampler.next_2d()
    if not rfilter.is_box_filter() and rfilter.radius() < 0.5:
        # elsewhere in the pixel it would weigh nothing: one of Cycles' least width, 0.01, has 0.05 % of a pixel
        place = corner + 0.5 + (place - corner - 0.5) * dr.opaque(mi.Float, 2.0 * rfilter.radius())
    # a sensor counts from 0 to 1 along the part of its film that is rendered
    on_film = (place - first - border) / dr.opaque(mi.Point2f, tuple(int(n) for n in film.crop_size()))
    on_lens = mi.Point2f(sampler.next_2d()) if sensor.needs_aperture_sample() else mi.Point2f(0.5)
    return sensor_ray(sensor, on_film, on_lens), corner if rfilter.is_box_filter() else place


def sensor_ray(sensor: mi.Sensor, on_film: mi.Point2f, on_lens: mi.Point2f) -> mi.Ray3f:
    """What `sensor.sample_ray` gives for places on the film and on a lens, in the middle of the exposure."""
    time = 0.5 * sensor.shutter_open_time()
    if sensor.class_name() != "PerspectiveCamera":  # the others have no size in their kernels
        return sensor.sample_ray(time, 0.5, on_film, on_lens)[0]
    params, film = mi.traverse(sensor), sensor.film()
    size, part, offset = (tuple(int(n) for n in of) for of in (film.size(), film.crop_size(), film.crop_offset()))

    def data(x: float, y: float) -> mi.Point2f:
        return dr.opaque(mi.Point2f, (x, y))

    on_film = on_film * data(part[0] / size[0], part[1] / size[1]) + data(offset[0] / size[0], offset[1] / size[1])
    on_film += mi.Point2f(params["principal_point_offset_x"], params["principal_point_offset_y"])
    slope = dr.tan(0.5 * dr.deg2rad(params["x_fov"])) * data(1.0, size[1] / size[0]) * (1.0 - 2.0 * on_film)
    towards = dr.normalize(mi.Vector3f(slope.x, slope.y, 1.0))
    near, far = (dr.opaque(mi.Float, params[name]) for name in ("near_clip", "far_clip"))
    to_world = params["to_world"]
    ray = mi.Ray3f(mi.Point3f(to_world.translation()), to_world @ towards, time, [])
    ray.o += ray.d * (near / towards.z)
    ray.maxt = (far - near) / towards.z
    return ray
