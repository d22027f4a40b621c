# SPDX-License-Identifier: Apache-2.0
"""The layer stack of the Principled BSDF as one view direction sees it.

Everything here depends on the view alone: Cycles attenuates each layer by the albedo of those above it at the view,
which makes the BSDF non-reciprocal. Order from the top: alpha, sheen, coat, emission, metal, glass, specular, diffuse.
Source: Blender 4.2-5.2, node "Principled BSDF" (Cycles closures), checked against renders.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import at_least, largest, root, saturate
from ..cycles_model import CyclesModel
from ..lobes.energy import NO_COMPENSATION, Compensation, compensation, glass_albedo, reflection_albedo, schlick_albedo
from ..lobes.fresnel import (
    average_conductor,
    average_dielectric,
    average_f82,
    average_schlick,
    dielectric,
    f82_slope,
    index_from_normal_incidence,
    normal_incidence,
)
from ..lobes.fresnel_term import ConductorTerm, ConstantTerm, DielectricTerm, MetalTerm
from ..lobes.microfacet import GGX, MICROFACETS, Microfacets
from ..lobes.sheen import SheenLobe, VelvetLobe, sheen_lobe
from ..lobes.thin_film import ThinFilm
from ..lobes.toon import ToonLobe
from .bumped_normals import BumpedNormals, about
from .needed_lobes import Lobes
from .principled_parameters import BLENDER_PRINCIPLED
from .random_walk import LEAST_PATH, Below

# A Glossy BSDF narrows alpha by up to 1 - 0.99 where a Principled BSDF's `anisotropic` of 1 leaves sqrt(0.1)
GLOSSY_ANISOTROPY = (1.0 - 0.01**2) / 0.9


@dataclass(frozen=True)
class Layers:
    """Weights (RGB, compensation included) and shapes of the lobes; None where a lobe is left out.

    Cycles draws coat and specular by their albedos, of light that gets to them and out again. `glass_colour` tints
    what glass lets through and `glass_reflected` what it reflects. `subsurface` is the Lambert lobe that stands for
    what is `below`, where nobody walks there. `normals` are there where nodes give them; then the frame is that of
    the microfacet lobes. `wi`, in the frame of the anisotropy, lies on the side of the normal. `cos_rotation`,
    `sin_rotation` turn a direction of the surface's own frame into it.
    """

    wi: Any
    cos_rotation: Any
    sin_rotation: Any
    flip: Any
    transparency: Any
    emission: Any
    ax: Any
    ay: Any
    facets: Microfacets = GGX
    sheen: Any = None
    sheen_shape: SheenLobe | VelvetLobe | ToonLobe | None = None
    coat: Any = None
    coat_albedo: Any = None
    coat_alpha: Any = None
    coat_ior: Any = None
    metal: Any = None
    metal_fresnel: MetalTerm | ConductorTerm | ConstantTerm | None = None
    glass: Any = None
    glass_alpha: Any = None
    glass_ior: Any = None
    glass_fresnel: DielectricTerm | ConstantTerm | None = None
    glass_colour: Any = None
    glass_reflected: Any = 1
    specular: Any = None
    specular_fresnel: DielectricTerm | None = None
    specular_albedo: Any = None
    diffuse: Any = None
    base: Any = None
    diffuse_roughness: Any = None
    subsurface: Any = None
    below: Below | None = None
    translucent: Any = None
    normals: BumpedNormals | None = None

    def to_frame(self, direction: Any) -> Any:
        """`direction` of the surface's frame in that of the lobes: the view's side up, tangent along the first axis."""
        z = dr.mulsign(direction.z, self.flip)
        x = self.cos_rotation * direction.x + self.sin_rotation * direction.y
        y = self.cos_rotation * direction.y - self.sin_rotation * direction.x
        return dr.kind_of(direction)(x, y, z)

    def from_frame(self, direction: Any) -> Any:
        """The inverse of `to_frame`."""
        z = dr.mulsign(direction.z, self.flip)
        x = self.cos_rotation * direction.x - self.sin_rotation * direction.y
        y = self.cos_rotation * direction.y + self.sin_rotation * direction.x
        return dr.kind_of(direction)(x, y, z)

    def blurred(self, least: Any) -> Layers:
        """These layers with microfacet lobes of alpha `least` or more; albedos stay, as with Cycles' Filter Glossy."""
        names = ("ax", "ay", "coat_alpha", "glass_alpha")
        wider = {n: dr.maximum(getattr(self, n), least) for n in names if getattr(self, n) is not None}
        return replace(self, **wider)


def layer_stack(parameters: Mapping[str, Any], wi: Any, lobes: Lobes, model: CyclesModel) -> Layers:
    """The layers for a view along `wi` (surface frame, either side), from parameter values by name.

    Values are numbers, tuples or Dr.Jit arrays of the float type of `wi`; missing ones are Blender's defaults.
    """
    number, colour, p = _typed(parameters, wi)
    stack: dict[str, Any] = {"flip": wi.z}
    angle = p["anisotropic_rotation"] * (2 * dr.pi)
    # The rotation is about the normal of the side that is seen
    sine, cosine = dr.sincos(dr.mulsign(angle, wi.z)) if lobes.anisotropic else (number(0), number(1))
    stack |= {"cos_rotation": cosine, "sin_rotation": sine}
    z = dr.abs(wi.z)
    view = dr.kind_of(wi)(cosine * wi.x + sine * wi.y, cosine * wi.y - sine * wi.x, z)
    mu = dr.maximum(z, 1e-7)
    stack["wi"] = view

    roughness = saturate(p["roughness"])
    ax = ay = dr.maximum(dr.square(roughness), 1e-6)
    lobe_roughness = roughness
    if lobes.anisotropic:
        most = GLOSSY_ANISOTROPY if model.shader == "glossy" else 1.0
        stretch = dr.sqrt(1 - 0.9 * most * saturate(p["anisotropic"] / most))
        ax, ay = dr.minimum(ax / stretch, 1), ay * stretch
        lobe_roughness = dr.sqrt(dr.sqrt(ax * ay))
    stack |= {"ax": ax, "ay": ay, "facets": MICROFACETS[model.microfacets]}

    w = colour(saturate(p["alpha"])) if lobes.alpha else colour(1)
    stack["transparency"] = 1 - saturate(p["alpha"]) if lobes.alpha else number(0)
    frame = Layers(view, cosine, sine, wi.z, 0, 0, ax, ay)
    stack["normals"] = normals = BumpedNormals.of(parameters, frame.to_frame, shade=model.bumps_shade)
    if lobes.sheen:
        w = _add_sheen(stack, p, w, view if normals is None else about(normals.diffuse, view), model)
    if lobes.coat:
        w = _add_coat(stack, p, w, mu if normals is None else dr.maximum(dr.dot(normals.coat, view), 1e-7), model)
    stack["emission"] = p["emission_color"] * p["emission_strength"] * w

    film = ThinFilm(p["thin_film_thickness"], p["thin_film_ior"], model) if lobes.thin_film else None
    metallic = saturate(p["metallic"])
    if model.shader == "translucent":
        return Layers(**stack, translucent=w * at_least(p["base_color"], 0))
    clamped_base = dr.minimum(at_least(p["base_color"], 0), 1)
    # The reflecting lobes share these two look-ups
    white = reflection_albedo(lobe_roughness, mu) if model.multiple_scattering else None
    if lobes.metal and model.shader == "glossy":
        colour_of_all = at_least(p["base_color"], 0)
        gain = _compensation(white, colour_of_all)
        stack |= {"metal": w * metallic * gain.scale, "metal_fresnel": ConstantTerm(colour_of_all)}
        w = w * (1 - metallic)
    elif lobes.metal and model.shader == "conductor":
        index, extinction = at_least(p["metal_ior"], 0), at_least(p["metal_extinction"], 0)
        gain = _compensation(white, average_conductor(index, extinction))
        stack |= {"metal": w * metallic * gain.scale, "metal_fresnel": ConductorTerm(index, extinction)}
        w = w * (1 - metallic)
    elif lobes.metal:
        slope = f82_slope(clamped_base, dr.minimum(at_least(p["specular_tint"], 0), 1)) if lobes.edge_tint else None
        gain = _compensation(white, average_f82(clamped_base, slope))
        stack["metal"] = w * metallic * gain.scale
        stack["metal_fresnel"] = MetalTerm(clamped_base, slope, film if model.film_fourier else None)
        w = w * (1 - metallic)
    if lobes.transmission:
        w = _add_glass(stack, p, w, wi, mu, roughness, clamped_base, film, model)
    if lobes.dielectric:
        _add_plastic(stack, p, w, mu, lobe_roughness, clamped_base, film, white, lobes, model)
    return Layers(**stack)


def sampled_emission(parameters: Mapping[str, Any], wi: Any, lobes: Lobes) -> Any:
    """Radiance emitted towards `wi` as Cycles' light samples of a surface see it before Blender 5.2.

    It makes no closures for them, so of what lies above only alpha and the coat's tint count. Found by renders: the
    light of a surface with a sheen is 8 % brighter with light samples (Emission Sampling) than without.
    """
    _, colour, p = _typed(parameters, wi)
    w = colour(saturate(p["alpha"])) if lobes.alpha else colour(1)
    if lobes.coat:
        w = w * _below_coat(p, dr.maximum(dr.abs(wi.z), 1e-7))
    return p["emission_color"] * p["emission_strength"] * w


def _typed(parameters: Mapping[str, Any], wi: Any) -> tuple[Any, Any, dict[str, Any]]:
    """The kinds of numbers and of colours, and all values by name as such."""
    number = dr.kind_of(wi.z)
    colour = next((dr.kind_of(v) for k, v in parameters.items() if _is_colour(k) and dr.is_array_v(v)), dr.kind_of(wi))
    return number, colour, {
        item.name: (colour if item.size == 3 else number)(parameters.get(item.name, item.default))
        for item in BLENDER_PRINCIPLED
    }  # fmt: skip


def _is_colour(name: str) -> bool:
    return name in BLENDER_PRINCIPLED.names and BLENDER_PRINCIPLED[name].size == 3


def _compensation(white: tuple[Any, Any] | None, mean_fresnel: Any) -> Compensation:
    return NO_COMPENSATION if white is None else compensation(*white, mean_fresnel)


def _add_sheen(stack: dict[str, Any], p: Mapping[str, Any], w: Any, view: Any, model: CyclesModel) -> Any:
    roughness = saturate(p["sheen_roughness"])
    if model.shader in ("toon", "toon_glossy"):
        shape = ToonLobe(view, p["toon_size"], p["toon_smooth"], glossy=model.shader == "toon_glossy")
    else:
        shape = VelvetLobe(view, roughness) if model.velvet else sheen_lobe(view, roughness)
    albedo, tint = at_least(p["sheen_weight"], 0) * shape.albedo, at_least(p["sheen_tint"], 0)
    stack |= {"sheen": w * albedo * tint, "sheen_shape": shape}
    # of the tint alone: at weight 0 all channels of the product are equal, and the slope would be that of any of them
    return w * saturate(1 - albedo * largest(tint))


def _add_coat(stack: dict[str, Any], p: Mapping[str, Any], w: Any, mu: Any, model: CyclesModel) -> Any:
    weight, roughness = at_least(p["coat_weight"], 0), saturate(p["coat_roughness"])
    n = at_least(p["coat_ior"], 1)
    f0 = normal_incidence(n)
    if model.coat_compensation:  # also with the GGX distribution
        gain = _compensation(reflection_albedo(roughness, mu), average_dielectric(n))
        albedo = dr.select(n > 1, f0 + (1 - f0) * schlick_albedo(roughness, mu, n), 0)
    else:
        gain, albedo = NO_COMPENSATION, dielectric(mu, n)
    albedo = weight * gain.weight * albedo
    stack |= {"coat": w * weight * gain.scale, "coat_albedo": w * albedo, "coat_ior": n}
    stack["coat_alpha"] = dr.maximum(dr.square(roughness), 1e-6)
    return w * saturate(1 - albedo) * _below_coat(p, mu)


def _below_coat(p: Mapping[str, Any], mu: Any) -> Any:
    """What the coat's tint leaves: absorption along the refracted view path, once for in and out."""
    path = dr.rcp(root(1 - (1 - dr.square(mu)) / dr.square(at_least(p["coat_ior"], 1))))
    absorbed = dr.exp(dr.log(dr.maximum(p["coat_tint"], 1e-30)) * path)
    return 1 + (absorbed - 1) * at_least(p["coat_weight"], 0)


def _add_glass(
    stack: dict[str, Any],
    p: Mapping[str, Any],
    w: Any,
    wi: Any,
    mu: Any,
    roughness: Any,
    base: Any,
    film: ThinFilm | None,
    model: CyclesModel,
) -> Any:
    weight, ior = saturate(p["transmission_weight"]), at_least(p["ior"], 1e-5)
    inside = wi.z < 0
    n = dr.select(inside, dr.rcp(ior), ior)
    f0 = saturate(normal_incidence(ior) * p["specular_tint"])
    # a Glass BSDF tints both sides by its colour, the Principled BSDF what is let through, once in and once out
    colour = base if model.shader in ("glass", "refraction") else root(base)
    gain = _compensation(glass_albedo(roughness, mu, n, ior) if model.multiple_scattering else None, colour)
    stack |= {
        "glass": w * weight * gain.scale,
        "glass_alpha": dr.maximum(dr.square(roughness), 1e-6),
        # at exactly 1 the half vector of refraction has no length and its density is infinite
        "glass_ior": dr.select(dr.abs(n - 1) < 1e-4, 1 + 1e-4, n),
        "glass_fresnel": DielectricTerm(f0, n, film.seen_from_inside(inside, ior) if film else None),
        "glass_colour": colour,
    }
    if model.shader == "glass":
        stack["glass_reflected"] = colour
    elif model.shader == "refraction":
        stack |= {"glass": w * weight, "glass_fresnel": ConstantTerm(0 * colour)}
    return w * (1 - weight)


def _add_plastic(
    stack: dict[str, Any],
    p: Mapping[str, Any],
    w: Any,
    mu: Any,
    roughness: Any,
    base: Any,
    film: ThinFilm | None,
    white: tuple[Any, Any] | None,
    lobes: Lobes,
    model: CyclesModel,
) -> None:
    ior = at_least(p["ior"], 1e-5)
    level = at_least(p["specular_ior_level"], 0) * 2
    normal = normal_incidence(ior) * level
    f0 = saturate(normal * p["specular_tint"])
    raised = index_from_normal_incidence(normal)
    n = dr.select(level == 1, ior, dr.select(ior < 1, dr.rcp(raised), raised))
    fresnel = DielectricTerm(f0, n, film)
    gain = _compensation(white, average_schlick(n, f0))
    albedo = f0 + (1 - f0) * schlick_albedo(roughness, mu, n)
    if film is not None:
        albedo = dr.select(film.present, fresnel(mu), albedo)
    present = (n != 1) | (film.present if film is not None else False)
    # A channel that the coat's tint has made black takes no part in the achromatic attenuation; when all are black, as
    # under a fully metallic surface, the derivative still has to see the attenuation
    counts = (w > 0) | (largest(w) <= 0)
    hidden = dr.select(counts & present, gain.weight * albedo, 0)
    stack |= {"specular": dr.select(present, w * gain.scale, 0), "specular_fresnel": fresnel}
    stack["specular_albedo"] = dr.select(present, w * gain.weight * albedo, 0)
    w = w * saturate(1 - largest(hidden))
    colour = at_least(p["base_color"], 0)
    if lobes.subsurface:
        amount = saturate(p["subsurface_weight"])
        walks = w * amount * dr.select(p["subsurface_radius"] * p["subsurface_scale"] < LEAST_PATH, 0, 1)
        stack |= {"below": Below.of(p, walks, n, model), "subsurface": base * walks}
        w = w - walks  # a channel without a radius has a diffuse lobe in its place
    stack |= {"diffuse": w * colour, "base": colour}
    if lobes.diffuse_roughness and model.diffuse_roughness:
        stack["diffuse_roughness"] = saturate(p["diffuse_roughness"])
