# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba plugin `closure_tree`: a fitted material among held ones, each with a weight that may vary.

Choose the variant before importing this. Properties are `fitted`, a nested `blender_principled`, and its `weight`;
further `leaf_0`, `weight_0`, `leaf_1`, ... of the same plugin, which are held and may only glow, and `clear_0`,
`clear_weight_0`, ... , colours of what passes straight through. Weights and colours are numbers, colours or textures.
The surface is the sum of all, as Mix and Add Shader of Blender have it. Light walks below the surface of one leaf;
where several let it, a Lambert lobe stands for that in each of them.

`factor_0`, `factor_1`, ... are factors of Mix Shaders that may change; a leaf that hangs on them has `ways` (that of
number k `ways_k`) which its weight is multiplied with: the sum over words such as "1.5 -0 +1", a share times 1 - factor
0 times factor 1. `varies`, and `varies_0` and so on, say that somebody changes the textures of a leaf or of its weight.
`mi.traverse` shows the factors, the fitted material's values, and those of leaves that have `free` ones or vary.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import reduce
from operator import or_
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..arrays.clamp import mean
from ..principled.bumped_normals import LEAF_NORMALS
from ..principled.mix_values import ways_in
from ..principled.random_walk import Below
from .closure_leaf import Leaf, at, colour_or_texture, number_or_texture
from .principled_plugin import BlenderPrincipled

PLUGIN_NAME = "closure_tree"
LEAST = 1e-3  # of the weights that choose a leaf: none has no chance where all are black


@dataclass(frozen=True)
class Mixture:
    """What is drawn of a tree at a surface point.

    Where `is_held` it is `drawn`, or goes `straight`; elsewhere the fitted material draws by the number `u1`. `weight`
    and `chance` are the fitted material's, `passes` (RGB) and `passing_chance` those of what goes straight through all
    else, and `held` gives value and density of the held materials for a direction.
    """

    weight: Any
    chance: Any
    u1: Any
    is_held: Any
    straight: Any
    drawn: Any
    passes: Any
    passing_chance: Any
    held: Callable[[Any], tuple[Any, Any]]


class ClosureTree(mi.BSDF):
    """A weighted sum of Blender's materials and of what passes straight through."""

    def __init__(self, props: mi.Properties) -> None:
        mi.BSDF.__init__(self, props)
        self.factors = [dr.opaque(mi.Float, float(props[f"factor_{k}"])) for k in _counted(props, "factor_")]
        self.fitted = self._leaf(props, "fitted", "")
        self.held = tuple(self._leaf(props, f"leaf_{k}", f"_{k}") for k in _counted(props, "leaf_"))
        self.clear = tuple(
            (colour_or_texture(props[f"clear_{k}"]), number_or_texture(props.get(f"clear_weight_{k}", 1.0)))
            for k in _counted(props, "clear_")
        )
        for leaf in (self.fitted, *self.held):
            if not isinstance(leaf.material, BlenderPrincipled):
                raise RuntimeError("a leaf of closure_tree is no blender_principled")
        self.scattering = tuple(leaf for leaf in self.held if not leaf.only_glows)
        walking = [leaf for leaf in self.leaves if leaf.material.has_below]
        self.walking = walking[0] if len(walking) == 1 else None
        for leaf in self.leaves:
            leaf.material.walks = leaf is self.walking
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        components = [leaf.material.flags() for leaf in self.leaves]
        if self.clear:
            components.append(mi.BSDFFlags.Null | both)
        self.m_components = components
        self.m_flags = reduce(or_, components)

    def _leaf(self, props: mi.Properties, leaf: str, end: str) -> Leaf:
        """The leaf whose own properties end so."""
        weight, ways = number_or_texture(props.get(f"weight{end}", 1.0)), ways_in(str(props.get(f"ways{end}", "")))
        return Leaf(props[leaf], weight, ways, self.factors, bool(props.get(f"varies{end}", False)))

    @property
    def free_leaves(self) -> dict[int, Leaf]:
        """Of the leaves beside the fitted one those that may change, by their numbers."""
        return {k: leaf for k, leaf in enumerate(self.held) if leaf.is_free}

    @property
    def is_open(self) -> bool:
        """Whether more than the fitted material may change."""
        return bool(self.factors or self.free_leaves or self.fitted.varies)

    @property
    def leaves(self) -> tuple[Leaf, ...]:
        """The fitted material and those held ones that scatter light."""
        return (self.fitted, *self.scattering)

    @property
    def is_held_in_lanes(self) -> bool:
        """Whether lanes of a first hit hold it, but for what the fitted material is: no glass, and holes of one grey.

        A held material is no part of lanes if it is glass or cut out; what is translucent has lanes on both sides.
        """
        is_grey = [not isinstance(c, mi.Texture) and float(np.ptp(np.ravel(c))) == 0.0 for c, _ in self.clear]
        return all(is_grey) and not any(leaf.material.lobes.clear for leaf in self.held)

    @property
    def is_translucent(self) -> bool:
        """Whether light is scattered to the other side."""
        return any(leaf.material.is_translucent for leaf in self.leaves)

    @property
    def absorbing(self) -> BlenderPrincipled | None:
        """The fitted material, which has the values of the volume, if that takes of the light inside."""
        absorbs = self.fitted.material.absorbs and (self.clear or any(leaf.material.lets_in for leaf in self.leaves))
        return self.fitted.material if absorbs else None

    @property
    def has_below(self) -> bool:
        """Whether light walks below the surface."""
        return self.walking is not None

    @property
    def walks_are_held(self) -> bool:
        """Whether it does so below a leaf that nothing changes."""
        return self.walking is not None and self.walking is not self.fitted and not self.walking.is_free

    def below(self, si: mi.SurfaceInteraction3f, active: Any) -> Below | None:
        """What the view finds below a surface point; None where no light walks there."""
        leaf = self.walking
        found = leaf.material.below(si, active) if leaf is not None else None
        if leaf is None or found is None:
            return None
        return replace(found, weight=found.weight * leaf.weight_at(si, active))

    @property
    def walked(self) -> BlenderPrincipled:
        """The material that light walks below."""
        return (self.walking or self.fitted).material

    @property
    def model(self) -> Any:
        """The fitted material's switches."""
        return self.fitted.material.model

    @property
    def directions(self) -> Any:
        """Normals and tangents that nodes give the fitted material."""
        return self.fitted.material.directions

    @property
    def bumped(self) -> bool:
        """Whether the fitted material's lobes have normals of their own."""
        return self.fitted.material.bumped

    def traverse(self, callback: Any) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Show the fitted material, and what else may change."""
        callback.put("fitted", self.fitted.material, mi.ParamFlags.Differentiable)
        for k, leaf in self.free_leaves.items():
            callback.put(f"leaf_{k}", leaf.material, mi.ParamFlags.Differentiable)
        for k, factor in enumerate(self.factors):
            callback.put(f"factor_{k}", factor, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: Any = ()) -> None:
        """Keep the factors what no kernel knows."""
        dr.make_opaque(self.factors)

    def picture_of(self, name: str) -> Any:
        """The texture of a value of `values_at`, or of a direction of the fitted material, that has one."""
        number, _, own = name.removeprefix("leaf_").rpartition(".")
        leaf = self.held[int(number)] if number else self.fitted
        return leaf.weight if own == "weight" else leaf.material.picture_of(own)

    def values_at(self, si: mi.SurfaceInteraction3f, active: Any) -> dict[str, Any]:
        """The fitted material's values at a surface point; where more is free, those of free leaves and weights.

        Directions that nodes give these leaves are those of `normals_at`, in the frame of the fitted one's microfacets.
        """
        values = self.fitted.material.values_at(si, active)
        if not self.is_open:
            return values
        values["weight"] = self.fitted.plain_weight_at(si, active)
        bumped = any(leaf.material.bumped for leaf in self.free_leaves.values())
        frame = self.bumped_frame(si, active)[0] if bumped and self.bumped else si.sh_frame
        for k, leaf in self.free_leaves.items():
            of_leaf = leaf.material.values_at(si, active) | {"weight": leaf.plain_weight_at(si, active)}
            if leaf.material.bumped:
                given = leaf.material.normals_at(si, active)
                of_leaf |= {name: mi.Vector3f(frame.to_local(given[name])) for name in LEAF_NORMALS.names}
            values |= {f"leaf_{k}.{name}": value for name, value in of_leaf.items()}
        return values

    def bumped_frame(self, si: mi.SurfaceInteraction3f, active: Any) -> Any:
        """The frame of the fitted material's microfacets."""
        return self.fitted.material.bumped_frame(si, active)

    def shading_normal(self, si: mi.SurfaceInteraction3f, active: Any) -> mi.Vector3f:
        """The mesh's normal on the side of the view, as a displacement by bump has bent it."""
        return self.fitted.material.shading_normal(si, active)

    def directions_at(self, si: mi.SurfaceInteraction3f, active: Any) -> dict[str, Any]:
        """The fitted material's normals at a surface point."""
        return self.fitted.material.directions_at(si, active)

    def held_value(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """f_r |cos| of the materials that nothing changes with their weights, RGB."""
        context, value = mi.BSDFContext(), mi.Color3f(0)
        for leaf in self.scattering:
            if not leaf.is_free:
                value += leaf.weight_at(si, active) * leaf.material.eval(context, si, wo, active)
        return value

    def held_emission(self, si: mi.SurfaceInteraction3f, active: Any = True) -> mi.Color3f:
        """The light towards `si.wi` of the materials that nothing changes."""
        held = (leaf.emitted(si, active, sampled=False) for leaf in self.held if leaf.glows and not leaf.is_free)
        return sum(held, mi.Color3f(0))

    def emitted(self, si: mi.SurfaceInteraction3f, active: Any, *, sampled: bool) -> mi.Color3f:
        """The surface's own light towards `si.wi`, perhaps to a light sample."""
        every = (leaf.emitted(si, active, sampled=sampled) for leaf in (self.fitted, *self.held) if leaf.glows)
        return sum(every, mi.Color3f(0))

    def eval(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """f_r |cos|, RGB."""
        value = mi.Color3f(0)
        for leaf in self.leaves:
            value += leaf.weight_at(si, active) * leaf.material.eval(ctx, si, wo, active)
        return value

    def pdf(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """Density of `sample` per solid angle."""
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True
    ) -> tuple[Any, Any]:
        """`eval` and `pdf`, the layers evaluated once."""
        return self._eval_pdf(self.leaves, self._chances(si, active)[0], ctx, si, wo, active)

    def glossy_share(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f) -> Any:
        """How likely `sample` has drawn a direction of a glossy lobe of any leaf."""
        ctx, leaves = mi.BSDFContext(), [leaf.material for leaf in self.leaves]
        likely = [c * m.pdf(ctx, si, wo) for c, m in zip(self._chances(si, True)[0], leaves, strict=True)]
        glossy = sum(p * m.glossy_share(si, wo) for p, m in zip(likely, leaves, strict=True))
        return glossy / dr.maximum(sum(likely), 1e-30)

    def mixture(self, si: mi.SurfaceInteraction3f, u1: Any, u2: mi.Point2f, active: Any) -> Mixture:
        """What is drawn at a surface point, and all that does not depend on the fitted material's values."""
        ctx = mi.BSDFContext()
        (chance, *held), through = self._chances(si, active)
        straight = active & (u1 < through)
        own = (u1 >= through) & (u1 < through + chance)
        drawn, start = dr.zeros(mi.BSDFSample3f), through + chance
        passes, passing_chance = self._clear(si, active), through
        for each, leaf in zip(held, self.scattering, strict=True):
            chosen = active & (u1 >= start)  # the last of them stays
            start += each
            sampled, _ = leaf.material.sample(ctx, si, _within(u1, start - each, each), u2, chosen)
            drawn = dr.select(chosen, sampled, drawn)
            if leaf.material.lobes.alpha:
                passes += leaf.weight_at(si, active) * leaf.material.eval_null_transmission(si, active)
                passing_chance = passing_chance + each * leaf.material.passing_chance(ctx, si, active)
        straight |= active & (drawn.pdf > 0) & mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Null)
        return Mixture(
            weight=self.fitted.weight_at(si, active),
            chance=chance,
            u1=_within(u1, through, chance),
            is_held=active & ~own,
            straight=straight,
            drawn=drawn,
            passes=passes,
            passing_chance=passing_chance,
            held=lambda wo: self._eval_pdf(self.scattering, held, ctx, si, wo, active),
        )

    def sample(
        self,
        ctx: mi.BSDFContext,
        si: mi.SurfaceInteraction3f,
        sample1: Any,
        sample2: mi.Point2f,
        active: Any = True,
    ) -> tuple[mi.BSDFSample3f, Any]:
        """A direction of any leaf and value over density."""
        mix, fitted = self.mixture(si, sample1, sample2, active), self.fitted.material
        own, _ = fitted.sample(ctx, si, mix.u1, sample2, active & ~mix.is_held)
        bs = dr.select(mix.is_held, mix.drawn, own)
        straight = mix.straight | (~mix.is_held & (bs.pdf > 0) & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null))
        value, density = self.eval_pdf(ctx, si, bs.wo, active)
        passes, chance = mix.passes, mix.passing_chance
        if fitted.lobes.alpha:
            passes += mix.weight * fitted.eval_null_transmission(si, active)
            chance += mix.chance * fitted.passing_chance(ctx, si, active)
        density, value = dr.select(straight, chance, density), dr.select(straight, passes, value)
        valid = active & ((bs.pdf > 0) | straight) & (density > 0)
        bs.wo, bs.pdf = dr.select(straight, -si.wi, bs.wo), dr.select(valid, density, 0)
        bs.eta, bs.sampled_component = mi.Float(1), mi.UInt32(0)
        bs.sampled_type = dr.select(straight, mi.UInt32(+mi.BSDFFlags.Null), bs.sampled_type)
        return bs, dr.select(valid, value / dr.maximum(density, 1e-30), 0)

    def eval_null_transmission(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Share of light that passes unchanged."""
        value = self._clear(si, active)
        for leaf in self.leaves:
            if leaf.material.lobes.alpha:
                value += leaf.weight_at(si, active) * leaf.material.eval_null_transmission(si, active)
        return dr.select(active, value, 0)

    def eval_diffuse_reflectance(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Base colour of the fitted material."""
        return self.fitted.material.eval_diffuse_reflectance(si, active)

    def to_string(self) -> str:
        """Short description."""
        return f"ClosureTree[{self.fitted.material.to_string()}, {len(self.held)} held, {len(self.clear)} clear]"

    def _chances(self, si: mi.SurfaceInteraction3f, active: Any) -> tuple[list[Any], Any]:
        """The probability of each leaf by its weight, and that of a straight passage."""
        weights = [dr.maximum(dr.detach(leaf.weight_at(si, active)), 0) + LEAST for leaf in self.leaves]
        through = dr.maximum(mean(dr.detach(self._clear(si, active))), 0) if self.clear else mi.Float(0)
        scale = dr.rcp(sum(weights) + through)
        return [weight * scale for weight in weights], through * scale

    @staticmethod
    def _eval_pdf(leaves: Any, chances: Any, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        value, density = mi.Color3f(0), mi.Float(0)
        for chance, leaf in zip(chances, leaves, strict=True):
            f, p = leaf.material.eval_pdf(ctx, si, wo, active)
            value += leaf.weight_at(si, active) * f
            density += chance * p
        return value, density

    def _clear(self, si: mi.SurfaceInteraction3f, active: Any) -> Any:
        value = mi.Color3f(0)
        for colour, weight in self.clear:
            value += at(weight, si, active) * mi.Color3f(
                colour.eval(si, active) if isinstance(colour, mi.Texture) else colour
            )
        return value


def _within(u1: Any, start: Any, length: Any) -> Any:
    """A number of an interval as one of 0 to 1."""
    return dr.clip((u1 - start) / dr.maximum(length, 1e-12), 0, dr.one_minus_epsilon(mi.Float))


def _counted(props: mi.Properties, prefix: str) -> Iterator[int]:
    count = 0
    while f"{prefix}{count}" in props:
        yield count
        count += 1


def register() -> None:
    """Make `closure_tree` known to Mitsuba in the current variant."""
    mi.register_bsdf(PLUGIN_NAME, ClosureTree)
