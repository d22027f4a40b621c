# SPDX-License-Identifier: Apache-2.0
"""Radiance along rays that have nothing to do with the target's material at the first hit, by `cycles_path`."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ...types.light_paths import LightPaths


def traced_radiance(
    scene: mi.Scene,
    sampler: mi.Sampler,
    ray: mi.Ray3f,
    light_paths: LightPaths | None,
    depth: int,
    *,
    hide: bool = False,
    before: tuple[mi.Float, mi.Color3f] | None = None,
    met: mi.PreliminaryIntersection3f | None = None,
    walked: bool = False,
) -> mi.Color3f:
    """Radiance along `ray` over paths of up to `depth`, scene-linear; `hide` leaves lights that it meets out.

    `before` is the density and weight of a bounce the ray comes from. With what it has `met`, the emission of that is
    left out; `walked` is that of `cycles_path`.
    """
    from .cycles_path import PLUGIN_NAME, light_path_properties, register  # can be imported when a variant is set

    register()
    properties: dict[str, Any] = {"type": PLUGIN_NAME, "max_depth": depth, "hide_emitters": hide}
    camera_world = getattr(scene.integrator(), "camera_world", None)
    if camera_world is not None and before is None:
        properties["camera_world"] = camera_world
    integrator = mi.load_dict(properties | light_path_properties(light_paths or LightPaths()))
    return integrator.sample(dr.ADMode.Primal, scene, sampler, ray, before=before, met=met, walked=walked)[0]
