# SPDX-License-Identifier: Apache-2.0
"""Radiance along rays that have nothing to do with the target's material at the first hit, by `cycles_path`."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...material.plugins.material_kinds import MaterialKinds
from ...material.plugins.ray_kinds import GLOSSY, SCATTERED, is_by_ray
from ...types.light_paths import LightPaths


@dataclass(frozen=True)
class SentOn:
    """Radiance of rays, scene-linear, what of it the target has reflected on its way, and that times how often."""

    radiance: mi.Color3f
    reflected: mi.Color3f
    counted: mi.Color3f

    def __add__(self, other: SentOn) -> SentOn:
        return SentOn(self.radiance + other.radiance, self.reflected + other.reflected, self.counted + other.counted)

    def __mul__(self, factor: mi.Float) -> SentOn:
        return SentOn(self.radiance * factor, self.reflected * factor, self.counted * factor)


def traced_radiance(
    scene: mi.Scene,
    sampler: mi.Sampler,
    ray: mi.Ray3f,
    light_paths: LightPaths | None,
    depth: int,
    *,
    hide: bool = False,
    **further: Any,
) -> mi.Color3f:
    """Radiance along `ray` over paths of up to `depth`, scene-linear; `hide` leaves lights that it meets out.

    Further arguments are those of `cycles_path`: `before` is the density and weight of a bounce the ray comes from.
    With what it has `met`, the emission of that is left out.
    """
    tracer = _tracer(scene, light_paths, depth, hide=hide, after_bounce="before" in further)
    return tracer.sample(dr.ADMode.Primal, scene, sampler, ray, **further)[0]


def _tracer(scene: mi.Scene, light_paths: LightPaths | None, depth: int, *, hide: bool, after_bounce: bool) -> Any:
    """The integrator `cycles_path`; what rays straight from the camera see behind everything is no light of others."""
    from .cycles_path import PLUGIN_NAME, light_path_properties, register  # can be imported when a variant is set

    register()
    properties: dict[str, Any] = {"type": PLUGIN_NAME, "max_depth": depth, "hide_emitters": hide}
    camera_world = getattr(scene.integrator(), "camera_world", None)
    if camera_world is not None and not after_bounce:
        properties["camera_world"] = camera_world
    return mi.load_dict(properties | light_path_properties(light_paths or LightPaths()))


def tells_rays(scene: mi.Scene, target: Any, light_paths: LightPaths | None) -> bool:
    """Whether light over other surfaces hangs on the lobe of the `target`'s BSDF that sends a ray to them."""
    return light_paths is not None and is_by_ray(scene) and hasattr(target, "glossy_share")


def sent_on(
    scene: mi.Scene,
    target: mi.Shape,
    sampler: mi.Sampler,
    ray: mi.Ray3f,
    light_paths: LightPaths | None,
    depth: int,
    *,
    si: mi.SurfaceInteraction3f,
    wo: mi.Vector3f,
    met: mi.PreliminaryIntersection3f,
    by_chance: mi.Float,
) -> SentOn:
    """Radiance along rays that the `target`'s BSDF sends out from `si` along `wo`, but the emission of what they `met`.

    Where surfaces tell rays of a diffuse lobe from those of a glossy one, both are traced and count by what the target
    draws the direction by. To draw one of them had five times the noise (a room behind a pane that is glass to some).
    """
    bsdf, pointer = target.bsdf(), mi.ShapePtr(target)
    dr.make_opaque(pointer)  # its number in this process is no part of the kernel

    tracer = _tracer(scene, light_paths, depth, hide=False, after_bounce=light_paths is not None)

    def traced(**further: Any) -> SentOn:
        further |= {"met": met, "target": pointer, "went_through": si.wi.z * wo.z < 0.0}
        radiance, _, told, _ = tracer.sample(dr.ADMode.Primal, scene, sampler, ray, **further)
        return SentOn(radiance, *told)

    if light_paths is None:
        return traced()
    value, likely = MaterialKinds(scene).eval_pdf(si.bsdf(), mi.BSDFContext(), si, wo, mi.Bool(True))
    before = (likely, value / dr.maximum(likely, 1e-12))
    if not hasattr(bsdf, "glossy_share"):
        return traced(before=before)
    share = bsdf.glossy_share(si, wo)
    if not is_by_ray(scene):  # the kind only counts for the limits of bounces
        return traced(before=before, kind=dr.select(by_chance < share, GLOSSY, SCATTERED))
    glossy, scattered = (traced(before=before, kind=kind, weighed=likely) for kind in (GLOSSY, SCATTERED))
    return glossy * share + scattered * (1.0 - share)
