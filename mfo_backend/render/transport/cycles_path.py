# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba integrator `cycles_path`: a path tracer that treats indirect light as Cycles does.

What differs from Mitsuba's `prb` is Filter Glossy, the clamping of indirect light, limits for one kind of bounce
(Cycles 5.0: kernel/integrator/surface_shader.h, path_state.h, film/light_passes.h), that rays meet lamps
(`lamps.lamp`), and where shadow rays start (`smooth_facets`). Derivatives are those of path
replay (Vicini, Speierer, Jakob 2021, "Path Replay Backpropagation"), for materials only: lights and shapes are held.
Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
from mitsuba.ad.integrators.common import RBIntegrator  # pyright: ignore[reportMissingImports]

from ...material.plugins.material_kinds import MaterialKinds
from ...material.plugins.ray_kinds import CAMERA, GLOSSY, SCATTERED, kind_of_ray
from ...types.light_paths import NO_LIMIT, TRANSPARENT_BOUNCES, LightPaths
from ..lamps.met_lamps import SceneLamps, alone
from .absorption import Inside
from .camera_view import CameraView
from .shadow_rays import ShadowRays, is_unsampled, sample_light
from .smooth_facets import TRANSMITS, leaves_on, met_light, seen_side
from .subsurface_walks import materials_with_below, walks_at

PLUGIN_NAME = "cycles_path"
LEAST_CHANCE = 1e-6  # of a path to go on, for a division: one that is black by then shows nothing. No measurement
CERTAIN = 1e30  # density before the first bounce, and of mirrors
_LIMITS = ("diffuse_bounces", "glossy_bounces", "transmission_bounces")
_FEWEST = ("min_light_bounces", "min_transparent_bounces")
DIFFUSE = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.DiffuseTransmission


class CyclesPath(RBIntegrator):
    """`max_depth`, `hide_emitters` as `prb`, further the numbers of `LightPaths` by name.

    `own_normals` says that some materials tell the mesh's normals from those that are bent to the view. A nested
    texture `camera_world` is what rays straight from the camera see behind everything (`camera_world`).
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.filter_glossy = float(props.get("filter_glossy", 0.0))
        self.clamp_indirect = float(props.get("clamp_indirect", 0.0))
        self.camera_world = props.get("camera_world", None)
        self.own_normals = bool(props.get("own_normals", False))
        self.transparent_bounces = int(props.get("transparent_bounces", TRANSPARENT_BOUNCES))
        self.fewest = tuple(int(props.get(name, 0)) for name in _FEWEST)
        self.limits = tuple(int(props.get(name, NO_LIMIT)) for name in _LIMITS)

    def left_after(self, left: mi.UInt32, diffuse: mi.UInt32, glossy: mi.UInt32, through: mi.UInt32) -> mi.UInt32:
        """How much further a path goes after so many bounces of each kind: behind the last it meets lights alone."""
        done = (diffuse > self.limits[0]) | (glossy > self.limits[1]) | (through > self.limits[2])
        return dr.select(done, dr.minimum(left, 1), left)

    @dr.syntax
    def sample(
        self,
        mode: dr.ADMode,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.Ray3f,
        δL: Any = None,  # the name is that of Mitsuba's base class
        state_in: Any = None,
        active: Any = True,
        before: tuple[Any, Any] | None = None,
        met: Any = None,
        every_lamp: bool = False,
        walked: bool = False,
        kind: Any = SCATTERED,
        weighed: Any = 0,
        went_through: Any = False,
        target: Any = None,
        **_: Any,
    ) -> tuple[Any, Any, list[Any], Any]:
        """See `RBIntegrator.sample`; a path with `before`, density and weight of a bounce, begins after it.

        What `ray` has `met`, if that is known, is not looked for again, and its emission is left out. In a scene whose
        lights have no extent `every_lamp` sums the light of all of them where a camera ray ends, and further on one is
        drawn; it has no derivatives. With `walked` somebody else adds what comes from below the first hit
        (`exit_light`); for camera rays that is the first behind cut-outs. The bounce before has sent out rays of a
        `kind` (`by_ray`), perhaps `went_through` the surface, and its light samples are `weighed` against rays of this
        density that go straight on.
        With a `target`, a pointer to its shape, the third answer is the radiance that it has reflected on the way, and
        that times how often.
        """
        primal = mode == dr.ADMode.Primal
        lamps, shadows = SceneLamps(scene), ShadowRays(scene)
        terminator, view, absorption = shadows.terminator, CameraView(scene), shadows.absorption
        context, materials, by_ray = mi.BSDFContext(), MaterialKinds(scene), shadows.by_ray
        below = materials_with_below(scene) if walked else []
        ray = mi.Ray3f(dr.detach(ray))
        radiance = mi.Spectrum(0 if primal else state_in)
        change = mi.Spectrum(0 if δL is None else δL)
        throughput = mi.Spectrum(1)
        first = mi.Spectrum(1 if before is None else dr.detach(before[1]))
        least = mi.Float(CERTAIN if before is None else dr.detach(before[0]))
        bounce = mi.UInt32(0 if before is None else 1)
        left = mi.UInt32(self.max_depth)
        diffuse, glossy, through = mi.UInt32(0), mi.UInt32(0), mi.UInt32(0)
        if before is not None:
            reflected_by, passed = mi.Float(kind), mi.Bool(went_through)
            diffuse = mi.UInt32(dr.select(~passed & (reflected_by == SCATTERED), 1, 0))
            glossy = mi.UInt32(dr.select(~passed & (reflected_by == GLOSSY), 1, 0))
            through = mi.UInt32(dr.select(passed, 1, 0))
            left = self.left_after(left, diffuse, glossy, through)
        most = mi.UInt32(left)
        previous = dr.zeros(mi.Interaction3f)
        density = mi.Float(1)
        delta = mi.Bool(True)
        survival, straight_on = mi.Float(1), mi.Bool(False)
        if shadows.lets_through and before is not None:
            # what such a ray meets straight behind a surface is found by the light samples of where it was sent out
            density, delta = mi.Float(weighed), mi.Bool(False)
            previous.p = ray.o
        passages, kind = mi.UInt32(0), mi.Float(CAMERA if before is None else kind)
        inside, dimmed = absorption.outside(), mi.Color3f(1)
        active = mi.Bool(active)
        valid = mi.Bool(False)
        reflected, own, counted = mi.UInt32(0), mi.Color3f(0), mi.Color3f(0)
        known = met is not None
        hidden = self.hide_emitters and before is None

        while dr.hint(active, label=f"cycles_path ({mode.name})"):
            chance_to_go_on = mi.Float(1)
            if dr.hint(self.clamp_indirect > 0.0, mode="scalar"):
                beyond_fewest = is_beyond(self.fewest, bounce, passages, straight_on)
                chance_to_go_on = continuation(first * throughput / survival, beyond_fewest)
            straight = mi.Bool(before is None) & (diffuse + glossy + through == 0)
            if dr.hint(known, mode="scalar"):
                si = met.compute_surface_interaction(ray, mi.RayFlags.All, active)
            elif dr.hint(view.hides, mode="scalar"):
                si = view.met(ray, active, straight=straight).compute_surface_interaction(ray, mi.RayFlags.All, active)
            else:
                si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=bounce == 0, active=active)
            if dr.hint(hidden, mode="scalar"):
                skip = active & (bounce == 0) & si.is_valid() & (si.shape.emitter() != None)  # noqa: E711
                further = self.skip_area_emitters(scene, shadows.starts.ray(si, ray.d), True, skip)
                behind = further.compute_surface_interaction(shadows.starts.ray(si, ray.d), mi.RayFlags.All, skip)
                si[skip] = behind
            valid |= (bounce == 0) & si.is_valid()
            last = mi.Bool(shadows.ends(si, passages))  # its own light still counts
            si = seen_side(scene, si)
            by_others = bounce == 0
            if dr.hint(before is not None, mode="scalar"):  # cut-outs behind a bounce are not looked through
                by_others = (bounce == 1) & (passages == 0)
            bsdf = si.bsdf(ray)
            without = dr.select(by_others & walks_at(bsdf, below), 1.0, 0.0)
            si.duv_dx = mi.Point2f(least_alpha(self.filter_glossy, least), without)
            if dr.hint(by_ray, mode="scalar"):
                si.duv_dy = mi.Point2f(0, kind)
            if dr.hint(absorption, mode="scalar"):
                with dr.resume_grad(when=not primal):
                    dimmed = absorption.left(absorption.lengths(inside, si.t))
                throughput *= dr.detach(dimmed)

            # light that the last direction meets
            ds = met_light(scene, si, previous)
            beyond = active & ((left < most) | (passages > 0)) if known else active
            seen = beyond & ~((bounce == 0) & hidden & ~si.is_valid())
            light_density = scene.pdf_emitter_direction(previous, ds, seen & ~delta)
            emission = ds.emitter.eval(si, seen)
            if dr.hint(self.camera_world is not None, mode="scalar"):
                behind_all = straight & seen & ~si.is_valid()
                emission = dr.select(behind_all, seen_world(self.camera_world, ray.d, behind_all), emission)
            shown = throughput * emission * share(delta, density, light_density)
            shown *= clamp_factor(self.clamp_indirect, first * shown / survival, bounce >= 2)
            if dr.hint(lamps, mode="scalar"):
                likely = dr.select(delta, CERTAIN, density)
                sent_from = previous.p if shadows.lets_through else None
                shine = throughput * lamps.met(ray, si, beyond, density=likely, camera=straight, sent_from=sent_from)
                shown += shine * clamp_factor(self.clamp_indirect, first * shine / survival, bounce >= 2)

            survival *= chance_to_go_on
            goes_on = active & si.is_valid() & ~last
            scatters = goes_on & (left > 1)
            # behind its last bounce a path still goes straight on
            goes_on = goes_on if shadows.lets_through else scatters
            on_light = sampler.next_2d()
            if dr.hint(every_lamp, mode="scalar"):
                direct = throughput * of_lamps(
                    scene, shadows, materials, si, on_light, scatters, bounce == 0, passages, inside
                )
                direct = direct * clamp_factor(self.clamp_indirect, first * direct / survival, bounce >= 1)
            else:
                ds, light, _, ways = sample_light(scene, shadows, si, on_light, scatters, None, passages, inside)
                si.duv_dy = mi.Point2f(dr.select(is_unsampled(ds), 1, 0), kind if by_ray else 0)
                lit = scatters & (ds.pdf > 0) & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
                if dr.hint(terminator.bends, mode="scalar"):
                    light *= terminator.bend(si, si.to_local(ds.d), lit)
                with dr.resume_grad(when=not primal):
                    if dr.hint(absorption, mode="scalar"):
                        light *= absorption.left(ways)
                    if dr.hint(primal, mode="scalar"):
                        value, chance = materials.eval_pdf(bsdf, context, si, si.to_local(ds.d), lit)
                    else:
                        value, chance = bsdf.eval_pdf(context, si, si.to_local(ds.d), lit)
                    weight = dr.detach(share(alone(ds), ds.pdf, chance))
                    direct = dr.select(lit, throughput * value * light * weight, 0)
                    direct = direct * clamp_factor(self.clamp_indirect, first * direct / survival, bounce >= 1)

            u1, u2 = sampler.next_1d(), sampler.next_2d()
            if dr.hint(primal, mode="scalar"):
                bs, ratio = materials.sample(bsdf, context, si, u1, u2, goes_on)
            else:
                bs, ratio = bsdf.sample(context, si, u1, u2, goes_on)
            if dr.hint(terminator.bends, mode="scalar"):
                ratio *= terminator.bend(si, bs.wo, goes_on)
            onward = shadows.starts.ray(si, si.to_world(bs.wo))
            is_straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            onward.maxt = dr.select(is_straight, ray.maxt - si.t, onward.maxt)  # the camera's far clipping holds on
            is_through = (bs.sampled_type & TRANSMITS) != 0
            goes_on &= dr.any(throughput * ratio != 0)
            goes_on &= is_straight | (scatters & leaves_on(scene, si, bs.wo, is_through))

            if dr.hint(target is not None, mode="scalar"):
                at_target = si.shape == target
                own += dr.select(reflected > 0, shown, 0)
                counted += mi.Float(reflected) * shown
                times = reflected + dr.select(at_target & (si.wi.z * si.to_local(ds.d).z > 0), 1, 0)
                own += dr.select(times > 0, direct, 0)
                counted += mi.Float(times) * direct
                reflected[goes_on & ~is_straight & at_target & ~is_through] += 1
            if dr.hint(primal, mode="scalar"):
                radiance += shown + direct
            else:
                onwards = mi.Spectrum(radiance)
                radiance -= shown + dr.detach(direct)
                with dr.resume_grad():
                    again = bsdf.eval(context, si, si.to_local(onward.d), goes_on)
                    out = shown + direct + radiance * dr.relative_grad(again)
                    if dr.hint(absorption, mode="scalar"):
                        out += onwards * dr.relative_grad(dimmed)
                    if dr.hint(mode == dr.ADMode.Backward, mode="scalar"):
                        dr.backward_from(change * out)
                    else:
                        change += dr.forward_to(out)

            # a straight passage is no bounce of any kind
            counts = goes_on & ~is_straight
            is_diffuse = ((bs.sampled_type & DIFFUSE) != 0) & ~is_through
            diffuse[counts & is_diffuse] += 1
            glossy[counts & ~is_diffuse & ~is_through] += 1
            through[counts & is_through] += 1
            # what goes straight through is still on its way from where it was sent out
            sent = counts if shadows.lets_through else goes_on
            left[sent] -= 1
            passages[goes_on & ~counts] += 1
            if dr.hint(by_ray, mode="scalar"):
                kind = dr.select(counts, kind_of_ray(bs.sampled_type), kind)
            straight_on = mi.Bool(is_straight)
            left = self.left_after(left, diffuse, glossy, through)
            least[counts] = dr.minimum(least, dr.select(bs.pdf > 0, bs.pdf, least))
            bounce[sent] += 1
            throughput *= ratio
            inside = absorption.beyond(inside, si, bs.wo, goes_on)
            density = dr.select(sent, bs.pdf, density)
            delta = dr.select(sent, mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta), delta)
            previous = dr.select(sent, mi.Interaction3f(si), previous)
            ray = mi.Ray3f(onward)
            active = goes_on
            if dr.hint(known, mode="scalar"):
                met = scene.ray_intersect_preliminary(ray, active=active)

        return radiance if primal else change, valid, [] if target is None else [own, counted], radiance


@dr.syntax
def of_lamps(
    scene: mi.Scene,
    shadows: ShadowRays,
    materials: MaterialKinds,
    si: mi.SurfaceInteraction3f,
    on_light: mi.Point2f,
    active: mi.Bool,
    of_all: mi.Bool,
    passages: mi.UInt32,
    inside: Inside,
) -> mi.Color3f:
    """Light that a surface sends back, of lamps without extent: of all of them, or elsewhere of one that is drawn."""
    lamps, context, bsdf = scene.emitters_dr(), mi.BSDFContext(), si.bsdf()
    number, weight, _ = scene.sample_emitter(on_light.x, active)
    number, weight = dr.select(of_all, 0, number), dr.select(of_all, 1, weight)
    end = dr.select(of_all, dr.opaque(mi.UInt32, dr.width(lamps)), number + 1)
    total = mi.Color3f(0)
    active = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
    while dr.hint(active & (number < end), label="lamps"):
        lamp = dr.gather(mi.EmitterPtr, lamps, number, active)
        ds, light = lamp.sample_direction(si, on_light, active)
        lit = active & (ds.pdf > 0)
        light *= weight * shadows.left(shadows.passed(si, ds, lit, None, passages, inside))
        if dr.hint(shadows.terminator.bends, mode="scalar"):
            light *= shadows.terminator.bend(si, si.to_local(ds.d), lit)
        value, _ = materials.eval_pdf(bsdf, context, si, si.to_local(ds.d), lit)
        total += dr.select(lit, value * light, 0)
        number += 1
    return total


def seen_world(texture: Any, direction: Any, active: Any = True) -> Any:
    """Radiance of an equirectangular picture along world directions, +X in its middle, +Z at its top.

    The layout is that of Blender's Environment Texture (Cycles' `direction_to_equirectangular`).
    """
    flat = dr.zeros(mi.SurfaceInteraction3f, dr.width(direction))
    polar = dr.safe_acos(direction.z)
    flat.uv = mi.Point2f(0.5 - dr.atan2(direction.y, direction.x) / (2 * dr.pi), polar / dr.pi)
    return mi.Color3f(texture.eval(flat, active))


def share(alone: Any, density: Any, other: Any) -> Any:
    """Weight of a sample of `density` that another technique finds with density `other` (Veach 1995), 1 if none can."""
    return dr.select(alone, 1, density / dr.maximum(density + other, 1e-30))


def least_alpha(filter_glossy: float, density: Any) -> Any:
    """The least alpha of the microfacet lobes after bounces of which the unlikeliest had `density`."""
    if filter_glossy <= 0.0:
        return mi.Float(0)
    return 0.5 * dr.safe_sqrt(1 - density / filter_glossy)


def is_beyond(fewest: tuple[int, int], bounces: Any, passages: Any, straight_on: Any) -> Any:
    """Whether chance may end a path in Cycles: after the `fewest` bounces, or passages where it comes `straight_on`."""
    return dr.select(straight_on, passages > fewest[1] + 1, bounces > fewest[0] + 1)


def continuation(throughput: Any, ends: Any) -> Any:
    """How likely Cycles goes on with a path that chance `ends` (`path_state_continuation_probability`).

    What is left is divided by it, and clamped then. No path ends here, and what it shows is as much in the mean.
    """
    return dr.select(ends, dr.clip(dr.sqrt(dr.detach(dr.max(dr.abs(throughput)))), LEAST_CHANCE, 1), 1)


def clamp_factor(clamp_indirect: float, sample: Any, indirect: Any) -> Any:
    """What to scale a sample of light by, whose channels may add up to too much where it is `indirect`."""
    if clamp_indirect <= 0.0:
        return mi.Float(1)
    total = dr.detach(dr.sum(dr.abs(sample)))
    limit = 3.0 * clamp_indirect
    return dr.select(indirect & (total > limit), limit / total, 1)


def light_path_properties(light_paths: LightPaths) -> dict[str, float | int]:
    """Properties of the integrator."""
    numbers = {name: getattr(light_paths, name) for name in (*_LIMITS, *_FEWEST, "transparent_bounces")}
    return {"filter_glossy": light_paths.filter_glossy, "clamp_indirect": light_paths.clamp_indirect, **numbers}


def register() -> None:
    """Make `cycles_path` known to Mitsuba in the current variant."""
    mi.register_integrator(PLUGIN_NAME, CyclesPath)
