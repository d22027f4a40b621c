# SPDX-License-Identifier: Apache-2.0
"""What cameras see of light that has travelled below a surface, for pictures by path tracers that know none.

Behind the first hit of a camera ray a Lambert lobe stands for it. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import mitsuba as mi

from ...types.light_paths import LightPaths
from .camera_view import CameraView
from .exit_light import light_from_below, materials_with_below
from .smooth_facets import seen_side


def seen_from_below(
    scene: mi.Scene, ray: mi.Ray3f, sampler: mi.Sampler, light_paths: LightPaths | None, depth: int
) -> mi.Color3f:
    """Radiance along camera rays that has left the first surface from below, scene-linear."""
    materials = materials_with_below(scene)
    if not materials:
        return mi.Color3f(0)
    met = CameraView(scene).met(ray)
    si = seen_side(scene, met.compute_surface_interaction(ray, mi.RayFlags.All, met.is_valid()))
    return light_from_below(scene, materials, si, si.is_valid(), sampler, light_paths, depth)


class WithBelow:
    """As much of an integrator in Python as pictures use: `cycles_path` with what comes from below."""

    def __init__(self, integrator: Any, light_paths: LightPaths) -> None:
        self._integrator, self._light_paths = integrator, light_paths
        self.prepare, self.sample_rays = integrator.prepare, integrator.sample_rays

    def sample(self, *, scene: mi.Scene, sampler: mi.Sampler, ray: Any, **others: Any) -> tuple[Any, ...]:
        """Radiance along camera rays, and whether they meet anything."""
        ray = mi.Ray3f(ray)
        light, *rest = self._integrator.sample(scene=scene, sampler=sampler, ray=ray, walked=True, **others)
        return light + seen_from_below(scene, ray, sampler, self._light_paths, self._integrator.max_depth), *rest
