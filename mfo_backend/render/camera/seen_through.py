# SPDX-License-Identifier: Apache-2.0
"""Which rays of the camera find a shape behind nothing but what light goes through: glass, and what is cut out.

Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi

from ..random_numbers.path_random import PathRandom
from ..transport.camera_view import CameraView
from ..transport.ray_starts import RayStarts

MOST_SURFACES = 16  # that a ray goes through: two walls of a glass case are eight. No measurement
CLEAR = mi.BSDFFlags.Null | mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.DeltaTransmission


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
