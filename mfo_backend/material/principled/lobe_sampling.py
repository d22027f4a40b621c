# SPDX-License-Identifier: Apache-2.0
"""Directions drawn from the layer stack and their density.

A lobe is chosen by its estimated albedo at the view, then sampled: visible normals for the microfacet lobes, the
transformed cosine of the sheen, a cosine for the diffuse lobe. Probabilities carry no derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr

from ..arrays.clamp import mean
from ..lobes.microfacet import sample_visible, visible_pdf
from .blender_principled import reached, refraction_normal
from .bumped_normals import about, out_of
from .layers import Layers

NAMES = ("transparent", "sheen", "coat", "base", "glass", "diffuse", "translucent")


@dataclass(frozen=True)
class LobeChoice:
    """Probability of each lobe by name, in the order of `NAMES`; lobes that are left out are missing."""

    probability: dict[str, Any]

    def __getitem__(self, name: str) -> Any:
        return self.probability.get(name)


def is_diffuse(lobe: Any, shader: str) -> Any:
    """Whether what a drawn lobe of a shader scatters is a diffuse bounce, as Cycles counts them."""
    diffuse = lobe == NAMES.index("diffuse")
    return diffuse if shader == "toon_glossy" else diffuse | (lobe == NAMES.index("sheen"))


def lobe_choice(layers: Layers, with_transparency: bool, least_diffuse: float = 0.0) -> LobeChoice:
    """Probabilities from the weights of the layers, normalised over reflection, transmission and, if asked, alpha.

    Under glass the diffuse lobe gets at least `least_diffuse`: derivatives by its weight and colour need its
    directions also where it shows nothing itself, and a tiny probability makes them rare and huge.
    """
    mu = layers.wi.z
    strength: dict[str, Any] = {}
    if with_transparency:
        strength["transparent"] = layers.transparency
    if layers.sheen is not None:
        strength["sheen"] = mean(layers.sheen)
    if layers.coat is not None:
        strength["coat"] = mean(layers.coat_albedo)
    if layers.metal is not None and layers.metal_fresnel is not None:
        strength["base"] = mean(layers.metal * layers.metal_fresnel(mu))
    if layers.specular is not None:
        strength["base"] = strength.get("base", 0) + mean(layers.specular_albedo)
    if layers.glass is not None:
        strength["glass"] = mean(layers.glass)
    if layers.diffuse is not None:
        strength["diffuse"] = mean(layers.diffuse if layers.subsurface is None else layers.diffuse + layers.subsurface)
    if layers.translucent is not None:
        strength["translucent"] = mean(layers.translucent)
    # The floor keeps a direction for every material, black ones included
    strength = {name: dr.maximum(dr.detach(value), 0) for name, value in strength.items()}
    last = "diffuse" if "diffuse" in strength else next(reversed(strength))
    strength[last] += 1e-6
    scale = dr.rcp(sum(strength.values()))
    probability = {name: strength[name] * scale for name in NAMES if name in strength}
    if least_diffuse > 0.0 and "glass" in probability and "diffuse" in probability:
        diffuse = dr.maximum(probability["diffuse"], least_diffuse)
        others = (1 - diffuse) / dr.maximum(1 - probability["diffuse"], 1e-6)
        probability = {name: diffuse if name == "diffuse" else p * others for name, p in probability.items()}
    return LobeChoice(probability)


def pdf(layers: Layers, choice: LobeChoice, wo: Any, *, reachable_only: Any = False) -> Any:
    """Density per solid angle of `sample` for the smooth lobes, `wo` in the frame of the layers.

    As in Cycles, glass has a density also for the pairs no microfacet connects, where its value is not zero either but
    `sample` never arrives; it weighs light sampling there. `reachable_only` leaves these pairs out.
    """
    wi, above = layers.wi, wo.z > 0
    h = dr.normalize(wi + type(wi)(wo.x, wo.y, dr.abs(wo.z)))
    c = dr.maximum(dr.dot(wi, h), 1e-7)
    density: Any = 0
    if choice["base"] is not None:
        density += choice["base"] * visible_pdf(wi, h, layers.ax, layers.ay) / (4 * c)
    normals = layers.normals
    if choice["coat"] is not None and normals is None:
        density += choice["coat"] * visible_pdf(wi, h, layers.coat_alpha, layers.coat_alpha) / (4 * c)
    elif choice["coat"] is not None and normals is not None:
        density += choice["coat"] * _coat_pdf(layers, normals.coat, wo)
    if choice["glass"] is not None:
        alpha = layers.glass_alpha
        density += choice["glass"] * visible_pdf(wi, h, alpha, alpha) / (4 * c) * reflect_probability(layers, c)
    if normals is None:
        density = _with_diffuse(density, layers, choice, wo)
    density = dr.select(above & (wi.z > 0), density, 0)
    if normals is not None:  # part of their side is below the microfacets'
        diffuse = _with_diffuse(0, layers, choice, about(normals.diffuse, wo))
        density += dr.select((dr.dot(normals.diffuse, wo) > 0) & (wi.z > 0), diffuse, 0)
    if choice["glass"] is not None:
        alpha = layers.glass_alpha
        h, jacobian, possible = refraction_normal(layers, wo)
        through = visible_pdf(wi, h, alpha, alpha) * jacobian * (1 - reflect_probability(layers, dr.abs(dr.dot(wi, h))))
        counted = (wo.z < 0) & (wi.z > 0) & reached(possible, reachable_only)
        density += dr.select(counted, choice["glass"] * through, 0)
    if choice["translucent"] is not None:
        density += dr.select(wi.z > 0, choice["translucent"] * dr.maximum(-wo.z, 0) / dr.pi, 0)
    return dr.detach(density)


def glossy_share(layers: Layers, choice: LobeChoice, wo: Any) -> Any:
    """How likely `sample` has drawn `wo` of a lobe that scatters no diffuse bounce."""
    glossy = {name: chance for name, chance in choice.probability.items() if name in ("coat", "base", "glass")}
    return pdf(layers, LobeChoice(glossy), wo) / dr.maximum(pdf(layers, choice, wo), 1e-30)


def _with_diffuse(density: Any, layers: Layers, choice: LobeChoice, wo: Any) -> Any:
    """A density and those of sheen and diffuse lobes, about whose normal `wo` is."""
    if choice["sheen"] is not None and layers.sheen_shape is not None:
        density += choice["sheen"] * layers.sheen_shape.pdf(wo)
    if choice["diffuse"] is not None:
        density += choice["diffuse"] * dr.maximum(wo.z, 0) / dr.pi
    return density


def _coat_pdf(layers: Layers, normal: Any, wo: Any) -> Any:
    """Density of the lobe of a coat with a normal of its own."""
    wi, wo = about(normal, layers.wi), about(normal, wo)
    h = dr.normalize(wi + wo)
    density = visible_pdf(wi, h, layers.coat_alpha, layers.coat_alpha) / (4 * dr.maximum(dr.dot(wi, h), 1e-7))
    return dr.select((wi.z > 0) & (wo.z > 0), density, 0)


def reflect_probability(layers: Layers, c: Any) -> Any:
    """Probability that glass reflects at a microfacet seen under cosine `c`."""
    assert layers.glass_fresnel is not None
    fresnel = layers.glass_fresnel(c)
    reflected = mean(layers.glass * layers.glass_reflected * fresnel)
    through = mean(layers.glass * layers.glass_colour * (1 - fresnel))
    return dr.detach(reflected / dr.maximum(reflected + through, 1e-20))


def sample(layers: Layers, choice: LobeChoice, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
    """Direction in the frame of the layers, the index in `NAMES` of its lobe, and validity."""
    wi, vector = layers.wi, type(layers.wi)
    phi_sin, phi_cos = dr.sincos(2 * dr.pi * u2.x)
    radius = dr.sqrt(u2.y)
    cosine = vector(radius * phi_cos, radius * phi_sin, dr.safe_sqrt(1 - u2.y))
    normals = layers.normals
    about_diffuse = cosine if normals is None else out_of(normals.diffuse, cosine)
    wo, lobe, below = about_diffuse, dr.uint32_array_t(type(u1))(NAMES.index("diffuse")), u1 != u1
    chosen, reused, start = {}, u1, 0
    for name, probability in choice.probability.items():
        chosen[name] = (u1 >= start) & (u1 < start + probability)
        if name == "glass":
            reused = (u1 - start) / dr.maximum(probability, 1e-12)
        start = start + probability
        lobe = dr.select(chosen[name], NAMES.index(name), lobe)
    # one normal serves whichever microfacet lobe was chosen
    shapes = {"base": (layers.ax, layers.ay), "coat": (layers.coat_alpha,) * 2, "glass": (layers.glass_alpha,) * 2}
    ax = ay = None
    for name in (name for name in shapes if name in chosen):
        one, other = shapes[name]
        ax = one if ax is None else dr.select(chosen[name], one, ax)
        ay = other if ay is None else dr.select(chosen[name], other, ay)
    if ax is not None:
        h = sample_visible(wi, ax, ay, u2)
        reflected = h * (2 * dr.dot(wi, h)) - wi
        for name in ("base", "coat"):
            if name in chosen:
                wo = dr.select(chosen[name], reflected, wo)
        if "coat" in chosen and normals is not None:
            normal, view = normals.coat, about(normals.coat, wi)
            h_coat = sample_visible(view, layers.coat_alpha, layers.coat_alpha, u2)
            mirrored = out_of(normal, h_coat * (2 * dr.dot(view, h_coat)) - view)
            wo = dr.select(chosen["coat"], mirrored, wo)
        if "glass" in chosen:
            through, refracts = _through_glass(layers, h, reused)
            wo = dr.select(chosen["glass"], dr.select(refracts, through, reflected), wo)
            below |= chosen["glass"] & refracts
    if "sheen" in chosen and layers.sheen_shape is not None:
        fibres = layers.sheen_shape.sample(cosine)
        wo = dr.select(chosen["sheen"], fibres if normals is None else out_of(normals.diffuse, fibres), wo)
    if "translucent" in chosen:
        wo = dr.select(chosen["translucent"], vector(cosine.x, cosine.y, -cosine.z), wo)
        below |= chosen["translucent"]
    if "transparent" in chosen:
        wo = dr.select(chosen["transparent"], -wi, wo)
    wo = dr.detach(wo)
    transparent = lobe == NAMES.index("transparent")
    above = wo.z > 0
    if normals is not None:
        about_it = (lobe == NAMES.index("diffuse")) | (lobe == NAMES.index("sheen"))
        above = dr.select(about_it, dr.dot(normals.diffuse, wo) > 0, above)
    return wo, lobe, (wi.z > 0) & (transparent | dr.select(below, wo.z < 0, above))


def _through_glass(layers: Layers, h: Any, u1: Any) -> tuple[Any, Any]:
    """The direction refracted at the normal `h`, and whether the number `u1` in [0, 1) chooses it."""
    wi, n = layers.wi, layers.glass_ior
    c = dr.dot(wi, h)
    cos_t2 = 1 - (1 - dr.square(c)) / dr.square(n)
    # in total reflection nothing passes, also where nothing is reflected
    return h * (c / n - dr.safe_sqrt(cos_t2)) - wi / n, (u1 >= reflect_probability(layers, c)) & (cos_t2 > 0)
