# SPDX-License-Identifier: Apache-2.0
"""What camera rays see beside the target, in pixels that the target covers in part."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from ...types.light_paths import LightPaths
from ..camera.first_hits import FirstHits
from ..camera.primary_rays import PrimaryRays, fresh_sampler
from ..lamps.met_lamps import SceneLamps
from ..transport.below_surface import seen_from_below
from ..transport.traced_radiance import traced_radiance


def recorded_background(
    scene: mi.Scene,
    size: tuple[int, int],
    rays: PrimaryRays,
    ends: FirstHits,
    covered: NDArray[np.int64],
    lamps: SceneLamps,
    *,
    seed: int,
    depth: int,
    light_paths: LightPaths | None,
    hide_emitters: bool,
) -> NDArray[np.float32]:
    """Radiance (height, width, 3) of a picture of this `size`, linear Rec.709, of rays that pass the target, in the
    `covered` pixels only.

    `ends` is where the rays end, `covered` counts as they do; paths are of up to `depth`.
    """
    image = np.zeros((*size, 3), np.float32)
    looked_at = np.zeros(len(rays.pixel), bool)
    looked_at[covered] = True
    position = rays.position(dr.arange(mi.UInt32, len(rays)))
    wanted = ~ends.on_target & dr.gather(mi.Bool, own_memory(looked_at, mi.Bool), position)
    if ends.lost is not None:
        wanted &= ~ends.lost
    # a path tracer's first step takes ten times as long as a look at the environment, and most rays see nothing else
    traced = wanted if lamps else wanted & ends.met.is_valid()
    rest = wanted & ~traced
    dr.eval(traced, rest)

    def add(index: mi.UInt32, radiance: mi.Color3f) -> None:
        add_radiance(image, rays.pixel[np.array(rays.position(index))], mi.Color3f(radiance) * rays.weight(index))

    index = dr.compress(traced)
    if dr.width(index) > 0:
        sampler, ray = fresh_sampler(seed, dr.width(index)), ends.onward(rays.ray(index), index)
        radiance = traced_radiance(scene, sampler, ray, light_paths, depth, hide=hide_emitters, walked=True)
        add(index, radiance + seen_from_below(scene, ray, sampler, light_paths, depth))
        if lamps.seen and ends.gone is not None:
            before_holes = dr.zeros(mi.SurfaceInteraction3f, dr.width(index))
            before_holes.t = dr.gather(mi.Float, ends.gone, index)
            add(index, lamps.met(rays.ray(index), before_holes, mi.Bool(True), camera=True))
    index = dr.compress(rest)
    if dr.width(index) > 0 and not hide_emitters:
        from ..transport.cycles_path import seen_world  # can be imported when a variant is set

        environment, camera_world = scene.environment(), getattr(scene.integrator(), "camera_world", None)
        beyond = dr.zeros(mi.SurfaceInteraction3f, dr.width(index))
        beyond.wi = -rays.ray(index).d
        if camera_world is not None:
            add(index, seen_world(camera_world, -beyond.wi))
        elif environment is not None:
            add(index, environment.eval(beyond))
    return image


def add_radiance(image: NDArray[np.float32], pixel: NDArray[np.int64], radiance: mi.Color3f) -> NDArray[np.float32]:
    """Add to a picture (height, width, 3) what rays of these flat pixels carry, weighed by the filter; returns it.

    A path whose radiance is no number carries nothing, as in other pictures.
    """
    flat = image.reshape(-1, 3)
    radiance = dr.select(dr.all(dr.isfinite(radiance)), radiance, 0.0)
    dr.eval(radiance)  # component by component: converting the whole array bakes its width into a new kernel
    for channel in range(3):
        flat[:, channel] += np.bincount(pixel, radiance[channel].numpy(), len(flat))
    return image
