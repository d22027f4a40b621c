# SPDX-License-Identifier: Apache-2.0
"""Radiance along rays that have nothing to do with the target's material at the first hit, by `cycles_path`."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ...material.plugins.material_kinds import MaterialKinds
from ...material.plugins.ray_kinds import GLOSSY, SCATTERED, is_by_ray
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
    kind: Any = SCATTERED,
    weighed: Any = 0,
) -> mi.Color3f:
    """Radiance along `ray` over paths of up to `depth`, scene-linear; `hide` leaves lights that it meets out.

    `before` is the density and weight of a bounce the ray comes from. With what it has `met`, the emission of that is
    left out; `walked`, `kind` and `weighed` are those of `cycles_path`.
    """
    from .cycles_path import PLUGIN_NAME, light_path_properties, register  # can be imported when a variant is set

    register()
    properties: dict[str, Any] = {"type": PLUGIN_NAME, "max_depth": depth, "hide_emitters": hide}
    camera_world = getattr(scene.integrator(), "camera_world", None)
    if camera_world is not None and before is None:
        properties["camera_world"] = camera_world
    integrator = mi.load_dict(properties | light_path_properties(light_paths or LightPaths()))
    further = {"before": before, "met": met, "walked": walked, "kind": kind, "weighed": weighed}
    return integrator.sample(dr.ADMode.Primal, scene, sampler, ray, **further)[0]


def tells_rays(scene: mi.Scene, target: Any, light_paths: LightPaths | None) -> bool:
    """Whether light over other surfaces hangs on the lobe of the `target`'s BSDF that sends a ray to them."""
    return light_paths is not None and is_by_ray(scene) and hasattr(target, "glossy_share")


def sent_on(
    scene: mi.Scene,
    target: Any,
    sampler: mi.Sampler,
    ray: mi.Ray3f,
    light_paths: LightPaths | None,
    depth: int,
    *,
    si: mi.SurfaceInteraction3f,
    wo: mi.Vector3f,
    met: mi.PreliminaryIntersection3f,
) -> mi.Color3f:
    """Radiance along rays that the `target`'s BSDF sends out from `si` along `wo`, but the emission of what they `met`.

    Where surfaces tell rays of a diffuse lobe from those of a glossy one, both are traced and count by what the target
    draws the direction by. To draw one of them had five times the noise (a room behind a pane that is glass to some).
    """
    if light_paths is None:
        return traced_radiance(scene, sampler, ray, light_paths, depth, met=met)
    value, likely = MaterialKinds(scene).eval_pdf(si.bsdf(), mi.BSDFContext(), si, wo, mi.Bool(True))
    before = (likely, value / dr.maximum(likely, 1e-12))
    if not tells_rays(scene, target, light_paths):
        return traced_radiance(scene, sampler, ray, light_paths, depth, before=before, met=met)
    share, radiance = target.glossy_share(si, wo), mi.Color3f(0.0)
    for kind, part in ((GLOSSY, share), (SCATTERED, 1.0 - share)):
        further = {"before": before, "met": met, "kind": kind, "weighed": likely}
        radiance += part * traced_radiance(scene, sampler, ray, light_paths, depth, **further)
    return radiance
