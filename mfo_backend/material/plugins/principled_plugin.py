# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba plugin `blender_principled`. Choose the variant, an RGB one with derivatives, before importing this.

Properties are the names of `BLENDER_PRINCIPLED`, each a number, a colour or a nested texture read at the surface point,
further `distribution` ("MULTI_GGX", "GGX"), `blender_version` ("5.0"), `shader` ("principled", or another node of
`cycles_model.SHADERS`) and `free`: comma-separated names that will
change after loading, and `subsurface_method`. Lobes whose weight is zero, not textured and not free are not traced;
changing such a value later brings the lobe back and compiles anew.
`own_normals` (false) tells normals that turn away from the view: its glossy lobes alone take those that are bent to it,
which a surface point's frame has, and all others `own_normal`.
`filtered` (false) reads what the integrator `cycles_path` puts where no texture of Mitsuba 3.9 looks: the least alpha
of the microfacet lobes, for Filter Glossy, from `si.duv_dx.x`, a 1 from `si.duv_dx.y` where it leaves what is below
the surface to others (a `closure_tree` of which several let light walk there takes that from them, and they show their
stand-ins all the same), and a 1 from `si.duv_dy.x` for light that Cycles does not sample: directions that no microfacet
of rough glass leads to do not count there. `mi.traverse` shows
`<id>.base_color`, `<id>.roughness`, ...; textures as `<id>.<name>.data`. `normal`, `coat_normal` and `tangent` may be
textures of world directions on the camera's side, zero for the mesh's own.

A Mitsuba BSDF cannot emit. An emitting material needs a `blender_glow` emitter, which asks what is `emitted`. The
tangent is that of Mitsuba's shading frame, dp/du of the UV map.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, reduce
from operator import or_
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...types.errors import SetupError
from ...types.parameter import Value
from ..arrays.clamp import saturate
from ..cycles_model import CyclesModel, cycles_model
from ..principled.blender_principled import evaluate
from ..principled.bumped_normals import BUMPED_NORMALS, OWN_NORMALS, BumpedNormals, valid_normal
from ..principled.layers import Layers, layer_stack, sampled_emission
from ..principled.lobe_sampling import NAMES, LobeChoice, glossy_share, is_diffuse, lobe_choice, pdf, sample
from ..principled.needed_lobes import Lobes, needed_lobes
from ..principled.principled_parameters import BLENDER_PRINCIPLED
from ..principled.random_walk import Below
from .own_normal import own_normal
from .projective_texture import ProjectiveTexture
from .surface_layers import SurfaceLayers

PLUGIN_NAME = "blender_principled"
DIRECTIONS = ("shading_normal", "normal", "coat_normal", "tangent")
GIVEN = 0.1  # length of a direction above which there is one in a picture, where it may be a mean
GIVEN_BY_MESH = 1e-6  # the same of a mesh's tangents, which get shorter towards the axis that they circle


class BlenderPrincipled(mi.BSDF):
    """Blender's Principled BSDF, two-sided, with Cycles' two-directional convention (`wi` is the camera's side)."""

    def __init__(self, props: mi.Properties) -> None:
        mi.BSDF.__init__(self, props)
        if not mi.is_rgb:
            raise SetupError(f"blender_principled works in RGB, not in variant {mi.variant()!r}: use llvm_ad_rgb.")
        version = tuple(int(part) for part in str(props.get("blender_version", "5.0")).split("."))
        shader = str(props.get("shader", "principled"))
        walks = str(props.get("subsurface_method", "RANDOM_WALK"))
        self.model = cycles_model(version, str(props.get("distribution", "MULTI_GGX")), shader, walks)
        self.filtered, self.walks = bool(props.get("filtered", False)), True
        self.own_normals = bool(props.get("own_normals", False))
        self.free = {name.strip() for name in str(props.get("free", "")).split(",") if name.strip()}
        BLENDER_PRINCIPLED.select(self.free or BLENDER_PRINCIPLED.names)  # refuses unknown names
        self.given = [item.name for item in BLENDER_PRINCIPLED if item.name in props]
        fixed: dict[str, Value | None] = {}
        for item in BLENDER_PRINCIPLED:
            value: Any = props.get(item.name, item.default)
            if isinstance(value, mi.Texture):
                fixed[item.name] = None
            elif item.size == 3:
                value = mi.Color3f(value)
                fixed[item.name] = tuple(float(value[k][0]) for k in range(3))
            else:
                fixed[item.name] = float(value)
                value = mi.Float(value)
            setattr(self, item.name, value)
        self.directions = {name: props[name] for name in DIRECTIONS if name in props}
        self.fixed = fixed
        self._row: NDArray[np.float32] | None = None
        self._choose_lobes()
        # A lobe that is left out keeps its literal values, which the compiler removes
        dr.make_opaque([getattr(self, name) for name in self.opened])

    def _choose_lobes(self) -> None:
        self.lobes = needed_lobes(self.fixed, self.free)
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        varying = mi.BSDFFlags.SpatiallyVarying if None in self.fixed.values() else mi.BSDFFlags.Empty
        components = [mi.BSDFFlags.GlossyReflection | both | varying]
        if self.lobes.dielectric or self.lobes.sheen:
            components.append(mi.BSDFFlags.DiffuseReflection | both | varying)
        if self.lobes.transmission:
            components.append(mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.NonSymmetric | both | varying)
        if self.model.shader == "translucent":
            components.append(mi.BSDFFlags.DiffuseTransmission | both | varying)
        if self.lobes.alpha:
            components.append(mi.BSDFFlags.Null | both | varying)
        if self.lobes.anisotropic:
            components = [flag | mi.BSDFFlags.Anisotropic for flag in components]
        self.m_components = components
        self.m_flags = reduce(or_, components)
        # Tables are loaded at their first use, which must not fall into the recording of a rendering kernel
        _load_tables(self.lobes, self.model)

    def traverse(self, callback: Any) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Show every value; those of lobes that are left out too, so that a caller can set them."""
        for item in BLENDER_PRINCIPLED:
            callback.put(item.name, getattr(self, item.name), mi.ParamFlags.Differentiable)
        for name, texture in self.directions.items():
            callback.put(name, texture, mi.ParamFlags.NonDifferentiable)

    def parameters_changed(self, keys: Any = ()) -> None:
        """Trace the lobes of the changed values from now on, whatever they are."""
        changed = {key.split(".")[0] for key in keys or ()} & set(BLENDER_PRINCIPLED.names)
        if changed - self.free:
            self.free |= changed
            self._choose_lobes()
        dr.make_opaque([getattr(self, name) for name in changed])
        self._row = None

    def emitted(self, si: mi.SurfaceInteraction3f, active: Any, *, sampled: bool, **instead: Any) -> mi.Color3f:
        """The surface's own light towards `si.wi`, perhaps to a light sample, with the values `instead` of its own."""
        if sampled and not self.model.samples_see_layers:
            return mi.Color3f(sampled_emission(self.values_at(si, active) | instead, si.wi, self.lobes))
        return mi.Color3f(self.layers_at(si, active, **instead).layers.emission)

    @property
    def bumped(self) -> bool:
        """Whether lobes have normals of their own: what nodes give, or those of the mesh."""
        return self.own_normals or bool(self.directions)

    @property
    def absorbing(self) -> BlenderPrincipled | None:
        """Itself, if it takes of the light inside of its objects."""
        return self if self.absorbs and self.lets_in else None

    @property
    def absorbs(self) -> bool:
        """Whether there is an absorbing volume, or may be one."""
        return self.fixed["absorption_density"] != 0.0 or "absorption_density" in self.free

    @property
    def lets_in(self) -> bool:
        """Whether light gets to the other side of the surface."""
        return self.lobes.clear or self.is_translucent

    @property
    def is_translucent(self) -> bool:
        """Whether it scatters light to the other side."""
        return self.model.shader == "translucent"

    @property
    def has_below(self) -> bool:
        """Whether light walks below the surface."""
        return self.lobes.dielectric and self.lobes.subsurface

    @property
    def walked(self) -> BlenderPrincipled:
        """Itself, which light walks below."""
        return self

    def below(self, si: mi.SurfaceInteraction3f, active: Any) -> Below | None:
        """What the view finds below a surface point; None of a material without."""
        return self.layers_at(si, active).layers.below

    def leaving(self, si: mi.SurfaceInteraction3f, active: Any) -> BumpedNormals | None:
        """World directions of the normals by which light is lit that leaves from below; None where nodes give none.

        `si.wi` is the way on which it leaves. Cycles keeps a normal that would mirror it into the surface from that.
        """
        if not {"normal", "shading_normal"} & set(self.directions):
            return None
        normals = self.normals_at(si, active)
        return BumpedNormals(normals["smooth_normal"], normals["normal"], normals["normal"], self.model.bumps_shade)

    @property
    def opened(self) -> tuple[str, ...]:
        """Names of the values that are no part of the traced code."""
        return tuple(item.name for item in BLENDER_PRINCIPLED if item.name in self.given or item.name in self.free)

    @property
    def kind(self) -> tuple[Any, ...] | None:
        """What is traced: two materials of one kind differ in the values that are `opened`; None with textures."""
        if self.directions or None in self.fixed.values():
            return None
        return (self.lobes, self.model, self.filtered, self.walks, self.own_normals, self.opened)

    @property
    def row(self) -> NDArray[np.float32]:
        """The values that are `opened`, one after the other."""
        if self._row is None:
            self._row = np.concatenate([np.ravel(dr.detach(getattr(self, name))) for name in self.opened])
        return self._row

    def picture_of(self, name: str) -> Any:
        """The texture of a parameter or a direction that has one."""
        return self.directions[name] if name in self.directions else getattr(self, name)

    def values_at(self, si: mi.SurfaceInteraction3f, active: Any) -> dict[str, Any]:
        """Parameter values at a surface point, by name."""
        values: dict[str, Any] = {}
        for item in BLENDER_PRINCIPLED:
            value = getattr(self, item.name)
            if isinstance(value, mi.Texture):
                value = value.eval_1(si, active) if item.size == 1 else mi.Color3f(value.eval(si, active))
            values[item.name] = value
        return values

    def bumped_frame(
        self, si: mi.SurfaceInteraction3f, active: Any
    ) -> tuple[mi.Frame3f, mi.Vector3f, dict[str, mi.Vector3f]]:
        """The frame of the microfacet lobes at a surface point, the view in it, and the other normals in it by name."""
        view: Any = si.to_world(si.wi)
        side: Any = dr.mulsign(mi.Float(1), si.wi.z)
        given = self.normals_at(si, active)
        n, along = given["normal"] * side, given["tangent"]
        s = dr.normalize(along - n * dr.dot(n, along))
        # a frame turned to the view is left-handed
        own: Any = si.sh_frame
        handed = dr.dot(dr.cross(own.n, own.s), own.t)
        frame = mi.Frame3f(s, dr.mulsign(dr.cross(n, s), handed), n)
        return frame, frame.to_local(view), {name: frame.to_local(given[name]) for name in BUMPED_NORMALS.names}

    def normals_at(self, si: mi.SurfaceInteraction3f, active: Any) -> dict[str, mi.Vector3f]:
        """World directions at a surface point, on the side of the view: the `normal` of the microfacet lobes, those of
        `BUMPED_NORMALS`, and the `tangent`, in no particular plane."""
        view: Any = si.to_world(si.wi)
        geometric, smooth = _towards(view, si), self.shading_normal(si, active)
        bumped = self._turned_to_view("normal", si, smooth, active)
        coat = valid_normal(geometric, view, self._turned_to_view("coat_normal", si, smooth, active))
        along: Any = mi.Vector3f(si.sh_frame.s)
        if "tangent" in self.directions:
            texture = self.directions["tangent"]
            least = GIVEN if isinstance(texture, ProjectiveTexture) else GIVEN_BY_MESH
            given = mi.Vector3f(texture.eval(si, active))
            given -= dr.dot(given, smooth) * smooth  # Cycles' Tangent node has it in the smooth surface
            along = dr.select(dr.norm(given) > least, dr.normalize(given), along)
        facets = valid_normal(geometric, view, bumped)
        return {
            "normal": facets, "smooth_normal": smooth, "bumped_normal": bumped, "coat_normal": coat, "tangent": along,
        }  # fmt: skip

    def shading_normal(self, si: mi.SurfaceInteraction3f, active: Any) -> mi.Vector3f:
        """The mesh's normal on the side of the view, as a displacement by bump has bent it."""
        smooth: Any = mi.Vector3f(si.sh_frame.n) * dr.mulsign(mi.Float(1), si.wi.z)
        if self.own_normals:
            smooth = own_normal(si, smooth)
        return self._turned_to_view("shading_normal", si, smooth, active)

    def _turned_to_view(self, name: str, si: mi.SurfaceInteraction3f, smooth: mi.Vector3f, active: Any) -> mi.Vector3f:
        """The normal that nodes give, which they did for the side that the camera sees; `smooth` without one."""
        if name not in self.directions:
            return smooth
        texture = self.directions[name]
        given = mi.Vector3f(texture.eval(si, active))
        length = dr.norm(given)
        found: Any = given / dr.maximum(length, 1e-6)
        # at silhouettes a point takes its value from one that looks another way, on the same side of the mesh
        behind = texture.surface.is_behind(si) & (dr.dot(found, smooth) < 0)
        # Cycles (kernel/svm): a Normal Map is negated on back faces, a Bump turns their normal by its slope
        other = -found if texture.turned else found - 2 * dr.dot(found, smooth) * smooth
        return dr.select(length > GIVEN, dr.select(behind, other, found), smooth)

    def directions_at(self, si: mi.SurfaceInteraction3f, active: Any) -> dict[str, mi.Vector3f]:
        """The normals of `bumped_frame`, the axes of its frame in the world, and in that frame the mesh's geometric
        normal, on the side of the view, and its own tangent."""
        frame, _, normals = self.bumped_frame(si, active)
        geometric = _towards(si.to_world(si.wi), si)
        axes = {"frame_s": mi.Vector3f(frame.s), "frame_t": mi.Vector3f(frame.t), "frame_n": mi.Vector3f(frame.n)}
        own = {"geometric_normal": geometric, "own_tangent": mi.Vector3f(si.sh_frame.s)}
        return normals | axes | {name: frame.to_local(direction) for name, direction in own.items()}

    def layers_at(self, si: mi.SurfaceInteraction3f, active: Any, **instead: Any) -> SurfaceLayers:
        """The layers at a surface point, with the values `instead` of its own."""
        values, wi, frame = self.values_at(si, active) | instead, si.wi, None
        if self.bumped:
            frame, wi, normals = self.bumped_frame(si, active)
            values |= normals if self.directions else {name: normals[name] for name in OWN_NORMALS.names}
        layers = layer_stack(values, wi, self.lobes, self.model)
        if self.filtered:
            layers = layers.blurred(si.duv_dx.x)
            if layers.subsurface is not None and self.walks:
                layers = replace(layers, subsurface=layers.subsurface * (1 - si.duv_dx.y))
        return SurfaceLayers(layers, si, frame)

    def _choice(self, ctx: mi.BSDFContext, layers: Layers) -> LobeChoice:
        return lobe_choice(layers, with_transparency=self.lobes.alpha)

    def reachable_only(self, si: mi.SurfaceInteraction3f) -> Any:
        """Where directions no microfacet of rough glass leads to do not count: for light Cycles does not sample."""
        return si.duv_dy.x > 0 if self.filtered and self.lobes.transmission else False

    def eval(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """f_r |cos|, RGB."""
        surface, only = self.layers_at(si, active), self.reachable_only(si)
        value = mi.Color3f(evaluate(surface.layers, surface.to_local(wo), reachable_only=only))
        return dr.select(active, value, 0)

    def pdf(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True) -> Any:
        """Density of `sample` per solid angle."""
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(
        self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True, **instead: Any
    ) -> tuple[Any, Any]:
        """`eval` and `pdf`, the layers evaluated once; with the values of another material of this `kind` `instead`."""
        surface = self.layers_at(si, active, **instead)
        layers, local, only = surface.layers, surface.to_local(wo), self.reachable_only(si)
        density = pdf(layers, self._choice(ctx, layers), local, reachable_only=only)
        value = mi.Color3f(evaluate(layers, local, reachable_only=only))
        return dr.select(active, value, 0), dr.select(active, density, 0)

    def glossy_share(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f) -> Any:
        """How likely `sample` has drawn a direction of a glossy lobe."""
        surface, ctx = self.layers_at(si, True), mi.BSDFContext()
        return glossy_share(surface.layers, self._choice(ctx, surface.layers), surface.to_local(wo))

    def sample(
        self,
        ctx: mi.BSDFContext,
        si: mi.SurfaceInteraction3f,
        sample1: Any,
        sample2: mi.Point2f,
        active: Any = True,
        **instead: Any,
    ) -> tuple[mi.BSDFSample3f, Any]:
        """A direction of any lobe and value over density; straight through with probability 1 - alpha.

        With the values of another material of this `kind` `instead`.
        """
        surface = self.layers_at(si, active, **instead)
        layers = surface.layers
        choice = self._choice(ctx, layers)
        local, lobe, valid = sample(layers, choice, sample1, sample2)
        valid &= active
        density = pdf(layers, choice, local)
        weight = dr.select(density > 0, mi.Color3f(evaluate(layers, local)) / dr.maximum(density, 1e-30), 0)
        glass, through = (lobe == NAMES.index(name) for name in ("glass", "translucent"))
        diffuse = is_diffuse(lobe, self.model.shader)
        kind = dr.select(diffuse, mi.UInt32(+mi.BSDFFlags.DiffuseReflection), mi.UInt32(+mi.BSDFFlags.GlossyReflection))
        kind = dr.select(glass & (local.z < 0), mi.UInt32(+mi.BSDFFlags.GlossyTransmission), kind)
        kind = dr.select(through, mi.UInt32(+mi.BSDFFlags.DiffuseTransmission), kind)
        if choice["transparent"] is not None:
            through = lobe == NAMES.index("transparent")
            density = dr.select(through, choice["transparent"], density)
            weight = dr.select(through, mi.Color3f(layers.transparency / dr.maximum(density, 1e-12)), weight)
            kind = dr.select(through, mi.UInt32(+mi.BSDFFlags.Null), kind)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.pdf = surface.from_local(local), dr.select(valid, density, 0)
        bs.eta = 1.0  # radiance is not scaled at the interface
        bs.sampled_type, bs.sampled_component = kind, mi.UInt32(0)
        return bs, dr.select(valid, weight, 0)

    def eval_null_transmission(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Share of light that passes unchanged, 1 - alpha; a link may give alphas beyond 0 and 1."""
        alpha = saturate(self.values_at(si, active)["alpha"])
        return dr.select(active, mi.Color3f(1 - alpha), 0) if self.lobes.alpha else mi.Color3f(0)

    def passing_chance(self, ctx: mi.BSDFContext, si: mi.SurfaceInteraction3f, active: Any) -> Any:
        """Probability that `sample` goes straight through."""
        choice = self._choice(ctx, self.layers_at(si, active).layers)
        return choice["transparent"] if self.lobes.alpha else mi.Float(0)

    def eval_diffuse_reflectance(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Base colour."""
        return mi.Color3f(self.values_at(si, active)["base_color"])

    def to_string(self) -> str:
        """Short description."""
        shown = ", ".join(f"{name}={getattr(self, name)}" for name in self.given)
        return f"BlenderPrincipled[{shown}]"


def _towards(view: mi.Vector3f, si: mi.SurfaceInteraction3f) -> mi.Vector3f:
    """The mesh's geometric normal on the side of the view."""
    geometric = mi.Vector3f(si.n)
    return dr.select(dr.dot(geometric, view) < 0, -geometric, geometric)


@cache
def _load_tables(lobes: Lobes, model: CyclesModel) -> None:
    """Read the tables that these lobes look into."""
    above = mi.Vector3f(0, 0, 1)
    for index in (mi.Float(1.5), dr.opaque(mi.Float, 1.5)):  # known and unknown ones read other tables
        indices = {"ior": index, "coat_ior": index, "specular_ior_level": index}
        evaluate(layer_stack(indices, above, lobes, model), above)
        evaluate(layer_stack({"ior": index, "coat_ior": index}, above, lobes, model), above)


def register() -> None:
    """Make `blender_principled` known to Mitsuba in the current variant."""
    mi.register_bsdf(PLUGIN_NAME, BlenderPrincipled)
