# SPDX-License-Identifier: Apache-2.0
"""The target's material where traced paths meet it: its value, a direction drawn from it, its own light, and their
derivatives by all free values. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false, reportAttributeAccessIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...material.plugins.closure_tree import ClosureTree
from ...material.plugins.principled_plugin import BlenderPrincipled
from ...material.principled.blender_principled import evaluate
from ...material.principled.lobe_sampling import NAMES, is_diffuse, lobe_choice, pdf, sample
from ...types.errors import UnrecordableError
from ..pictures.mitsuba_renderer import MitsubaRenderer
from ..transport.absorption import COLOR, DENSITY, coefficient
from .tangents import Tangents

LEAST_DIFFUSE = 0.02  # probability, under glass: more takes paths from the glass


@dataclass(frozen=True)
class Scattering:
    """What the material does at hits: RGB values with their derivatives, directions in the shading frame.

    `light` is f |cos| towards a light and `light_density` the density with which the material draws that direction;
    `drawn` is a direction that it drew, of the `kind` of mi.BSDFFlags, with its value `following` and its `density`.
    `glow` is the surface's own light, empty where it has none that layers dim.
    """

    light: list[Any]
    light_density: Any
    following: list[Any]
    density: Any
    drawn: Any
    kind: Any
    glow: list[Any]


class TracedTarget:
    """The material of a renderer's target, for many vectors of free values at once.

    Raises
    ------
    UnrecordableError
        If it is not of the plugin `blender_principled`.
    """

    def __init__(self, renderer: MitsubaRenderer) -> None:
        bsdf = renderer.shape.bsdf()
        self.tree = bsdf if isinstance(bsdf, ClosureTree) else None
        self.plugin = bsdf if self.tree is None else self.tree.fitted.material
        if not isinstance(self.plugin, BlenderPrincipled):
            raise UnrecordableError(f"Model {renderer.model!r} has no traced version for transmissive materials.")
        if renderer.mix is not None:
            raise UnrecordableError("Several shaders of a mix, or its factors, are fitted on opaque surfaces alone.")
        self.bsdf, self.table, self.tangents = bsdf, renderer.table, Tangents.of(renderer.table)
        emitter = renderer.shape.emitter() if renderer.shape.is_emitter() and self.tree is None else None
        self.glow: Any = emitter if getattr(emitter, "layered", False) else None

    def absorbs(self, theta, offset, directions) -> list[Any]:
        """Absorption inside per scene unit (RGB) and its derivatives, of the vectors that begin at `offset`."""
        values = {name: mi.Color3f(getattr(self.plugin, name)) for name in (DENSITY, COLOR)}
        slopes = {name: [mi.Color3f(0.0)] * directions for name in (DENSITY, COLOR)}
        for name in values:
            if name in self.table.names:
                entries = range(*self.table.slice_of(name).indices(self.table.length))
                values[name] = mi.Color3f(*(dr.gather(mi.Float, theta, offset + k) for k in entries))
                slopes[name] = [mi.Color3f(float(entry[0] in entries)) for entry in self.tangents.entries[:directions]]
        density, rest = values[DENSITY], 1.0 - values[COLOR]
        moved = zip(slopes[DENSITY], slopes[COLOR], strict=True)
        return [coefficient(*values.values()), *(a * rest - b * density for a, b in moved)]

    def at(self, si, wo, u1, u2, met, on, theta, offset, directions) -> Scattering:
        """What it does with light from `wo`, and in a direction drawn by `u1` and `u2`, where paths go `on`; its own
        light wherever they have `met` it. The vector of a path begins at its `offset` in `theta`."""
        plugin = self.plugin
        entries = [dr.gather(mi.Float, theta, offset + k, met) for k in range(self.table.length)]
        if directions:
            dr.enable_grad(*entries)
        parameters: dict[str, Any] = {}
        if self.glow is not None and not self.glow.of_surface:
            parameters |= {"emission_color": mi.Color3f(1.0), "emission_strength": mi.Float(1.0)}
        iterator = iter(entries)
        for p in self.table:
            parameters[p.name] = next(iterator) if p.size == 1 else mi.Color3f(*(next(iterator) for _ in range(3)))
        surface = plugin.layers_at(si, met, **parameters)
        layers = surface.layers
        choice = lobe_choice(layers, with_transparency=plugin.lobes.alpha, least_diffuse=LEAST_DIFFUSE)
        mixture = None if self.tree is None else self.tree.mixture(si, u1, u2, on)
        drawn, lobe, valid = sample(layers, choice, u1 if mixture is None else mixture.u1, u2)
        if mixture is not None:
            drawn = dr.select(mixture.is_held, surface.to_local(mixture.drawn.wo), drawn)
            valid = dr.select(mixture.is_held, mixture.drawn.pdf > 0.0, valid)
        towards, only = dr.detach(surface.to_local(wo)), plugin.reachable_only(si)
        f_light = mi.Color3f(evaluate(layers, towards, reachable_only=only))
        pdf_light = dr.detach(pdf(layers, choice, towards, reachable_only=only))
        f_next = mi.Color3f(evaluate(layers, drawn))
        pdf_next = dr.detach(pdf(layers, choice, drawn))
        diffuse = is_diffuse(lobe, plugin.model.shader)
        kind = dr.select(diffuse, mi.UInt32(+mi.BSDFFlags.DiffuseReflection), mi.UInt32(+mi.BSDFFlags.GlossyReflection))
        through = (lobe == NAMES.index("glass")) & (drawn.z < 0.0)
        kind = dr.select(through, mi.UInt32(+mi.BSDFFlags.GlossyTransmission), kind)
        kind = dr.select(lobe == NAMES.index("translucent"), mi.UInt32(+mi.BSDFFlags.DiffuseTransmission), kind)
        null, passes, chance = mi.Bool(False), mi.Color3f(0.0), mi.Float(0.0)
        if choice["transparent"] is not None:
            null = lobe == NAMES.index("transparent")
            passes, chance = mi.Color3f(layers.transparency), dr.detach(choice["transparent"])
        if mixture is not None:
            value, density = mixture.held(wo)
            f_light = mixture.weight * f_light + value
            pdf_light = mixture.chance * pdf_light + density
            value, density = mixture.held(dr.detach(surface.from_local(drawn)))
            f_next = mixture.weight * f_next + value
            pdf_next = mixture.chance * pdf_next + density
            kind = dr.select(mixture.is_held, mixture.drawn.sampled_type, kind)
            null = dr.select(mixture.is_held, mixture.straight, null)
            passes = mixture.weight * passes + mixture.passes
            chance = mixture.chance * chance + mixture.passing_chance
            valid |= mixture.is_held & mixture.straight
        if mixture is not None or choice["transparent"] is not None:
            f_next = dr.select(null, passes, f_next)
            pdf_next = dr.select(null, chance, pdf_next)
            kind = dr.select(null, mi.UInt32(+mi.BSDFFlags.Null), kind)
            drawn = dr.select(null, -layers.wi, drawn)
        pdf_next = dr.select(valid & on, pdf_next, 0.0)
        results = [f_light, f_next]
        if self.glow is not None:
            results.append(self.glow.unlayered(si, met) * mi.Color3f(layers.emission))
        columns = [[dr.detach(result)] for result in results]
        for entry in self.tangents.entries[:directions]:
            for k in entry:
                dr.set_grad(entries[k], 1.0)
                dr.enqueue(dr.ADMode.Forward, entries[k])
            dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearInterior | dr.ADFlag.ClearInput)
            for column, result in zip(columns, results, strict=True):
                column.append(mi.Color3f(dr.grad(result)))
                dr.clear_grad(result)
        light, following = ([dr.select(on, c, 0.0) for c in column] for column in columns[:2])
        glow = columns[2] if self.glow is not None else []
        drawn = dr.detach(surface.from_local(drawn))
        return Scattering(light, pdf_light, following, pdf_next, drawn, kind, glow)
