# SPDX-License-Identifier: Apache-2.0
"""Whole light paths over a target of Blender's Principled, and their derivatives by its free values.

Light that enters the target meets its material several times, so there is no single recorded direction. Here a path is
traced with the material itself and carries the derivative of its throughput by every free value (detached: the path
stays where it is). Emitters are sampled at every vertex, as by Mitsuba's `path`, or by
`cycles_path` with its Filter Glossy, clamping and limits of bounces where the scene asks for it.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false, reportAttributeAccessIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from ...material.plugins.ray_kinds import CAMERA, kind_of_ray
from ...types.errors import UnrecordableError
from ..camera.primary_rays import camera_ray, through_filter
from ..lamps.met_lamps import SceneLamps, alone
from ..pictures.mitsuba_renderer import MitsubaRenderer
from ..pictures.pass_counter import with_derivatives
from ..random_numbers.path_random import PathRandom
from ..transport.camera_view import CameraView
from ..transport.cycles_path import DIFFUSE, continuation, is_beyond, seen_world
from ..transport.shadow_rays import ShadowRays, is_unsampled, left_of, sample_light
from ..transport.smooth_facets import TRANSMITS, leaves_on, met_light, seen_side
from .traced_target import TracedTarget

LANES_OF_A_LAUNCH = 1 << 17  # of one launch: about a tenth of a second on two cores, so that a fit can stop between two
MOST_FLOATS = 1 << 24  # that leave one launch, 64 MB
DEEPEST = 32  # path length of a scene without a limit


class TracedPaths:
    """Pictures and Jacobians of chosen pixels for several vectors at once, under common random numbers.

    Parameters
    ----------
    renderer
        Its target has to be of the plugin `blender_principled`.

    Raises
    ------
    UnrecordableError
        For another material.
    """

    def __init__(self, renderer: MitsubaRenderer) -> None:
        self.renderer, self.table = renderer, renderer.table
        self._target = target = TracedTarget(renderer)
        self._bsdf, self._glow, self._tangents = target.bsdf, target.glow, target.tangents
        scene = renderer.scene
        integrator = scene.integrator()
        limit = int(getattr(integrator, "max_depth", DEEPEST))
        self._depth = DEEPEST if limit < 0 or limit > DEEPEST else limit
        self._hide = bool(getattr(integrator, "hide_emitters", False))
        if self._hide and renderer.shape.is_emitter():
            raise UnrecordableError("The target emits light and the integrator hides what does.")
        self._light_paths = renderer.light_paths
        self._lamps, self._shadows, self._view = SceneLamps(scene), ShadowRays(scene), CameraView(scene)
        self._terminator, self._absorption = self._shadows.terminator, self._shadows.absorption
        self._camera_world = getattr(integrator, "camera_world", None)
        # a mix tells by its other leaves what goes through it; of those this one's alpha is taken as it is
        names = () if target.tree is not None else self.table.names
        through = self._shadows.lets_through and "alpha" in names
        self._alpha_entry = (self.table.slice_of("alpha").start,) if through else None
        self._others = any(s.bsdf() is not None and s.bsdf() is not target.bsdf for s in scene.shapes())
        self.lanes = 0

    def roughness(self, vector: NDArray[np.float64]) -> float:
        """Roughness of the material `vector`; 1 where a texture gives it."""
        if "roughness" in self.table.names:
            return float(vector[self.table.slice_of("roughness").start])
        value = self._target.plugin.fixed["roughness"]
        return 1.0 if value is None else float(np.mean(value))

    def images(
        self,
        vectors: NDArray[np.float64],
        pixels: NDArray[np.int64],
        *,
        seed: int,
        samples: int,
        jacobian: bool,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> NDArray[np.float32]:
        """Means over `samples` paths a pixel, (m, p, 3, 1 + K) with derivatives or (m, p, 3, 1), for vectors (m, K).

        Path s of pixel p takes the same random numbers for every vector. Nothing more is traced once `should_stop`.
        """
        vectors = np.atleast_2d(vectors)
        count = (1 + len(self._tangents.entries)) if jacobian else 1
        result = np.zeros((len(vectors), len(pixels), 3, count), np.float32)
        most = min(LANES_OF_A_LAUNCH, MOST_FLOATS // (3 * count))
        rows = max(1, min(len(pixels), most // samples))
        models = max(1, most // (rows * samples))
        for begin in range(0, len(pixels), rows):
            for first in range(0, len(vectors), models):
                if should_stop():
                    return self._tangents.expand(result) if jacobian else result
                some = slice(begin, begin + rows)
                group = slice(first, first + models)
                result[group, some] = self._launch(vectors[group], pixels[some], begin, seed, samples, jacobian)
        film = self.renderer.scene.sensors()[0].film().crop_size()
        share = len(pixels) * samples * len(vectors) / float(film[0] * film[1])
        self.renderer.counter.add(with_derivatives(share / 16.0, self.table.length if jacobian else 0))
        return self._tangents.expand(result) if jacobian else result

    def _launch(self, vectors, pixels, begin, seed, samples, jacobian) -> NDArray[np.float32]:
        m, p = len(vectors), len(pixels)
        lanes = m * p * samples
        self.lanes += lanes
        theta = own_memory(vectors, mi.Float)
        pixel = own_memory(pixels, mi.UInt32)
        p_opaque, samples_opaque, begin_opaque = (dr.opaque(mi.UInt32, v) for v in (p, samples, begin))
        lane = dr.arange(mi.UInt32, lanes)
        block = lane // samples_opaque
        model = block // p_opaque
        row = block - model * p_opaque
        path = (row + begin_opaque) * samples_opaque + (lane - block * samples_opaque)
        rng = PathRandom.of(path, dr.opaque(mi.UInt32, seed & 0xFFFFFFFF))
        ray, weight = self._camera(dr.gather(mi.UInt32, pixel, row), rng)
        columns = self._trace(ray, rng, theta, model * self.table.length, jacobian)
        good = mi.Bool(True)
        for c in columns:
            good &= dr.all(dr.isfinite(c))
        sums = [dr.select(good, c[k] * weight, 0.0) for c in columns for k in range(3)]
        dr.eval(sums)
        means = [dr.block_sum(s, samples).numpy() for s in sums]
        table = np.stack(means, axis=-1).reshape(m, p, len(columns), 3)
        return np.swapaxes(table, 2, 3) / np.float32(samples)

    def _camera(self, pixel: mi.UInt32, rng: PathRandom) -> tuple[mi.Ray3f, mi.Float]:
        sensor = self.renderer.scene.sensors()[0]
        offset, sign = through_filter(sensor.film().rfilter())(rng.pair(0))
        return camera_ray(sensor, pixel, offset, rng.pair(1)), mi.Float(1.0) if sign is None else sign

    def _trace(self, ray, rng, theta, offset, jacobian) -> list[mi.Color3f]:
        """Radiance along the rays and its derivatives in all directions."""
        scene = self.renderer.scene
        directions = len(self._tangents.entries) if jacobian else 0
        alpha = None if self._alpha_entry is None else dr.gather(mi.Float, theta, offset + self._alpha_entry[0])
        sigma = self._target.absorbs(theta, offset, directions)
        state = {
            "ray": mi.Ray3f(ray),
            "beta": [mi.Color3f(1.0)] + [mi.Color3f(0.0) for _ in range(directions)],
            "total": [mi.Color3f(0.0) for _ in range(1 + directions)],
            "before": dr.zeros(mi.Interaction3f, dr.width(offset)),
            "density": mi.Float(1.0),
            "delta": mi.Bool(True),
            "depth": mi.UInt32(0),
            "left": mi.UInt32(self._depth),
            "passages": mi.UInt32(0),
            "inside": self._absorption.outside(),
            "active": mi.Bool(True),
        }
        if self._shadows.by_ray:
            state["kind"] = mi.Float(CAMERA)
        if self._light_paths is not None:
            # the least density so far, and bounces of each kind
            state |= {"least": mi.Float(1e30), "bounces": [mi.UInt32(0) for _ in range(3)]}
            # how many of such paths chance leaves in Cycles, and whether it was straight that this one came
            state |= {"survival": mi.Float(1.0), "straight_on": mi.Bool(False)}

        def body(s):
            ray, beta, total, active, depth = s["ray"], list(s["beta"]), list(s["total"]), s["active"], s["depth"]
            bounces = depth - s["passages"]
            straight, survival, chance_to_go_on = bounces == 0, *self._survival(s, bounces)
            if self._view.hides:
                first = self._view.met(ray, active, straight=straight)
                si = seen_side(scene, first.compute_surface_interaction(ray, mi.RayFlags.All, active))
            else:
                si = seen_side(scene, scene.ray_intersect(ray, active))
            last = mi.Bool(self._shadows.ends(si, s["passages"]))  # its own light still counts
            if self._absorption:
                beta = self._dimmed(beta, self._absorption.lengths(s["inside"], si.t), sigma)
            blur = self._blur(s)
            if blur is not None:
                si.duv_dx = mi.Point2f(blur, 0.0)
            of_ray = s.get("kind", CAMERA)
            si.duv_dy = mi.Point2f(0.0, of_ray)
            emitter = si.emitter(scene, active)
            ds = met_light(scene, si, s["before"])
            light = scene.pdf_emitter_direction(s["before"], ds, active & ~s["delta"])
            seen = dr.select(s["delta"], 1.0, self._share(s["density"], light))
            if self._hide:
                seen = dr.select(straight, 0.0, seen)
            emission = mi.Color3f(emitter.eval(si, active))
            if self._camera_world is not None:
                behind_all = straight & active & ~si.is_valid()
                emission = dr.select(behind_all, seen_world(self._camera_world, s["ray"].d, behind_all), emission)
            met, own = active & si.is_valid(), mi.Bool(False)
            if self._glow is not None:
                own = met & (emitter == mi.EmitterPtr(self._glow))
            emission = dr.select(active & ~own, emission * seen, 0.0)
            emission *= self._clamp(beta[0] * emission / survival, bounces >= 2)
            total = [t + b * emission for t, b in zip(total, beta, strict=True)]
            if self._lamps:
                likely = dr.select(s["delta"], 1e30, s["density"])
                sent_from = s["before"].p if self._shadows.lets_through else None
                shine = self._lamps.met(ray, si, active, density=likely, camera=straight, sent_from=sent_from)
                shine *= self._clamp(beta[0] * shine / survival, bounces >= 2)
                total = [t + b * shine for t, b in zip(total, beta, strict=True)]
            active = active & si.is_valid() & ~last
            scatters = active & (s["left"] > 1)
            # behind its last bounce a path still goes straight on
            active = active if self._shadows.lets_through else scatters
            # light sampled from here
            ds, value, times, ways = sample_light(
                scene, self._shadows, si, rng.pair(2 + 3 * depth), scatters,
                None if alpha is None else self._bsdf, s["passages"], s["inside"],
            )  # fmt: skip
            si.duv_dy = mi.Point2f(dr.select(is_unsampled(ds), 1.0, 0.0), of_ray)
            wo = si.to_local(ds.d)
            lit = scatters & (ds.pdf > 0.0)
            if self._glow is not None:  # which is left to the rays that meet it
                lit &= ds.emitter != mi.EmitterPtr(self._glow)
            u1, u2 = rng.pair(3 + 3 * depth).x, rng.pair(4 + 3 * depth)
            ours = si.bsdf() == mi.BSDFPtr(self._bsdf) if self._others else mi.Bool(True)
            on = active & ours
            at_hit = on if self._glow is None else met & ours
            found = self._target.at(si, wo, u1, u2, at_hit, on, theta, offset, directions)
            f_light, pdf_light, f_next, pdf_next = found.light, found.light_density, found.following, found.density
            local, kind = found.drawn, found.kind
            if self._glow is not None:
                glow = [dr.select(own, c, 0.0) for c in found.glow]
                kept = self._clamp(beta[0] * glow[0] / survival, bounces >= 2)
                total[0] += beta[0] * glow[0] * kept
                for k in range(directions):
                    total[1 + k] += (beta[1 + k] * glow[0] + beta[0] * glow[1 + k]) * kept
            if self._others:
                off = active & ~on
                context = mi.BSDFContext()
                bsdf = si.bsdf()
                f, p, bs, w = bsdf.eval_pdf_sample(context, si, wo, u1, u2, off)
                f_light[0] = dr.select(off, mi.Color3f(f), f_light[0])
                pdf_light = dr.select(off, p, pdf_light)
                f_next[0] = dr.select(off, mi.Color3f(w) * bs.pdf, f_next[0])
                pdf_next = dr.select(off, bs.pdf, pdf_next)
                local = dr.select(off, bs.wo, local)
                kind = dr.select(off, bs.sampled_type, kind)
            value *= self._terminator.bend(si, wo, lit)
            bend = self._terminator.bend(si, local, active)
            f_next = [f * bend for f in f_next]
            weight = value * dr.select(alone(ds), 1.0, self._share(ds.pdf, pdf_light))
            weight = dr.select(lit, weight, 0.0)
            left_over, slope = left_of(alpha, times)
            sent = [beta[0] * f_light[0]]
            for k in range(directions):
                sent.append(beta[1 + k] * f_light[0] + beta[0] * f_light[1 + k])
            if self._absorption:
                sent = self._dimmed(sent, ways, sigma)
            survival *= chance_to_go_on
            weight *= self._clamp(sent[0] * weight * left_over / survival, bounces >= 1)
            for k, light in enumerate(sent):
                total[k] += light * weight * left_over
                if k and self._tangents.entries[k - 1] == self._alpha_entry:
                    total[k] += sent[0] * weight * slope
            is_bounce = ~mi.has_flag(kind, mi.BSDFFlags.Null)
            usable = active & (pdf_next > 0.0)
            usable &= ~is_bounce | (scatters & leaves_on(scene, si, local, (kind & TRANSMITS) != 0))
            inverse = dr.select(usable, dr.rcp(dr.maximum(pdf_next, 1e-30)), 0.0)
            new = [beta[0] * f_next[0] * inverse]
            for k in range(directions):
                new.append((beta[1 + k] * f_next[0] + beta[0] * f_next[1 + k]) * inverse)
            # a path that shows nothing itself may have derivatives
            strongest = reduce(dr.maximum, (dr.max(dr.abs(c)) for c in new))
            active = usable & (strongest > 1e-5)
            # what goes straight through is still on its way from where it was sent out
            passages = s["passages"] + dr.select(is_bounce, mi.UInt32(0), 1)
            counts = is_bounce | (not self._shadows.lets_through)
            onward = self._shadows.starts.ray(si, si.to_world(local))
            onward.maxt = dr.select(is_bounce, onward.maxt, s["ray"].maxt - si.t)  # the camera's far clipping holds on
            after = {
                "ray": onward,
                "beta": new,
                "total": total,
                "before": dr.select(counts, mi.Interaction3f(si), s["before"]),
                "density": dr.select(counts, pdf_next, s["density"]),
                "delta": dr.select(counts, mi.has_flag(kind, mi.BSDFFlags.Delta), s["delta"]),
                "depth": depth + 1,
                "left": s["left"] - dr.select(counts, mi.UInt32(1), 0),
                "passages": passages,
                "inside": self._absorption.beyond(s["inside"], si, local, active),
                "active": active,
            }
            if self._shadows.by_ray:
                after["kind"] = dr.select(is_bounce, kind_of_ray(kind), s["kind"])
            after |= self._counted(s, kind, pdf_next, after["left"])
            if self._light_paths is not None:
                after |= {"survival": mi.Float(survival), "straight_on": passages > s["passages"]}
            return after

        (state,) = dr.while_loop((state,), lambda s: s["active"], lambda s: (body(s),), label="traced paths")
        return state["total"]

    def _dimmed(self, columns: list[Any], lengths: list[mi.Float], sigma: list[mi.Color3f]) -> list[Any]:
        """Light and its derivatives behind so much way through each absorbing material; `sigma` is the target's."""
        depth, own = mi.Color3f(0.0), mi.Float(0.0)
        known = zip(self._absorption.materials, self._absorption.coefficients(), lengths, strict=True)
        for material, coefficient, length in known:
            own = length if material is self._bsdf else own
            depth += (sigma[0] if material is self._bsdf else coefficient) * length
        share, (light, *changes) = dr.exp(-depth), columns
        return [
            light * share,
            *((c - light * own * slope) * share for c, slope in zip(changes, sigma[1:], strict=True)),
        ]

    def _blur(self, state: dict[str, Any]) -> mi.Float | None:
        """The least alpha of the microfacet lobes by Filter Glossy."""
        if self._light_paths is None or self._light_paths.filter_glossy <= 0.0:
            return None
        return 0.5 * dr.safe_sqrt(1.0 - state["least"] / self._light_paths.filter_glossy)

    def _share(self, a: mi.Float, b: mi.Float) -> mi.Float:
        """Weight of a sample of density `a` that another technique finds with `b` (Veach 1995), as the picture has it.

        `path` takes the power heuristic and `cycles_path` the balance heuristic; where samples are clamped it matters.
        """
        if self._light_paths is None:
            a, b = dr.square(a), dr.square(b)
        return dr.select(a > 0.0, a / (a + b), 0.0)

    def _survival(self, state: dict[str, Any], bounces: mi.UInt32) -> tuple[mi.Float, mi.Float]:
        """How many paths Cycles has left before it draws whether one goes on, and the chance that it does."""
        if self._light_paths is None or self._light_paths.clamp_indirect <= 0.0:
            return mi.Float(1.0), mi.Float(1.0)
        fewest = self._light_paths.min_light_bounces, self._light_paths.min_transparent_bounces
        survival = mi.Float(state["survival"])
        may_end = is_beyond(fewest, bounces, state["passages"], state["straight_on"])
        return survival, continuation(state["beta"][0] / survival, may_end)

    def _clamp(self, sample: mi.Color3f, indirect: mi.Bool) -> mi.Float | float:
        """What to scale a sample by whose channels add up to more than Cycles allows."""
        if self._light_paths is None or self._light_paths.clamp_indirect <= 0.0:
            return 1.0
        total, limit = dr.sum(dr.abs(sample)), 3.0 * self._light_paths.clamp_indirect
        return dr.select(indirect & (total > limit), limit / total, 1.0)

    def _counted(self, state: dict[str, Any], kind: mi.UInt32, density: mi.Float, left: mi.UInt32) -> dict[str, Any]:
        """Bounces of each kind and the least density after a bounce; a straight passage is none."""
        if self._light_paths is None:
            return {}
        counts = ~mi.has_flag(kind, mi.BSDFFlags.Null)
        through, diffuse = (kind & TRANSMITS) != 0, (kind & DIFFUSE) != 0
        of_kind = (diffuse & ~through, ~diffuse & ~through, through)
        limits = self._light_paths
        most = (limits.diffuse_bounces, limits.glossy_bounces, limits.transmission_bounces)
        bounces = [
            b + dr.select(counts & k, mi.UInt32(1), mi.UInt32(0))
            for b, k in zip(state["bounces"], of_kind, strict=True)
        ]
        done = mi.Bool(False)
        for count, limit in zip(bounces, most, strict=True):
            done |= count > limit
        least = dr.select(counts & (density > 0.0), dr.minimum(state["least"], density), state["least"])
        return {"least": least, "bounces": bounces, "left": dr.select(done, dr.minimum(left, 1), left)}
