# SPDX-License-Identifier: Apache-2.0
"""Blender's Principled BSDF as Cycles evaluates it: one function of parameter values and two directions.

Directions are unit vectors in the frame tangent, bitangent, normal and point away from the surface: `wi` towards the
camera, `wo` towards the light. Values are f_r |cos(wo)| in linear Rec.709, without the 1 / n^2 of radiance in glass
(Cycles leaves it out). Subsurface scattering is replaced by a diffuse lobe. The code is generic over the Dr.Jit float
type.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..arrays import dual as dr
from ..cycles_model import CyclesModel
from ..lobes.diffuse import lambert, oren_nayar
from ..lobes.fresnel import dielectric
from ..lobes.microfacet import reflection
from .bumped_normals import BumpedNormals, about
from .layers import Layers, layer_stack
from .needed_lobes import ALL_LOBES, Lobes

BLENDER_5_0 = CyclesModel()

Half = tuple[Any, Any]  # the half vector and its cosine with the view


def blender_principled(
    parameters: Mapping[str, Any], wi: Any, wo: Any, lobes: Lobes = ALL_LOBES, model: CyclesModel = BLENDER_5_0
) -> Any:
    """f_r |cos| for light from `wo` seen from `wi`, RGB.

    Parameters
    ----------
    parameters
        By name of `BLENDER_PRINCIPLED`: numbers, tuples or Dr.Jit arrays; missing ones are Blender's defaults.
    lobes
        What to evaluate; parts left out count as absent (`needed_lobes`).
    model
        Blender version and distribution (`cycles_model`).
    """
    layers = layer_stack(parameters, wi, lobes, model)
    return evaluate(layers, layers.to_frame(wo))


def evaluate(layers: Layers, wo: Any, *, reachable_only: Any = False) -> Any:
    """f_r |cos| of the stack for light from `wo` in the frame of the layers; `reachable_only` as in `refracted`."""
    if layers.normals is not None:
        return _evaluate_bumped(layers, layers.normals, wo, reachable_only)
    wi = layers.wi
    up, half = _above(wo), _half(wi, wo)
    value = _microfacets(layers, up, half)
    if layers.coat is not None:
        value += _coat(layers, wi, up, half)
    if layers.glass is not None:
        value += _glass_reflection(layers, up, half)
    value += _fibres(layers, up) + _diffuse(layers, wi, up)
    value = dr.select((wo.z > 0) & (wi.z > 0), value, 0)
    if layers.glass is not None and layers.glass_fresnel is not None:
        value += refracted(layers, wo, reachable_only=reachable_only)
    if layers.translucent is not None:
        value += layers.translucent * lambert(_turned_over(wo))
    return value


def _turned_over(wo: Any) -> Any:
    return dr.kind_of(wo)(wo.x, wo.y, -wo.z)


def _evaluate_bumped(layers: Layers, normals: BumpedNormals, wo: Any, reachable_only: Any) -> Any:
    """The same with a normal for each group of lobes; the layers' frame is that of the microfacets."""
    wi = layers.wi
    own = dr.kind_of(wi)(0, 0, 1)
    up, half = _above(wo), _half(wi, wo)
    value = _microfacets(layers, up, half)
    if layers.glass is not None:
        value += _glass_reflection(layers, up, half)
    value = dr.select(normals.lit(own, wo) & (wi.z > 0), value, 0)
    if layers.coat is not None:
        wi_coat, wo_coat = about(normals.coat, wi), about(normals.coat, wo)
        seen = normals.lit(normals.coat, wo) & (wi_coat.z > 0)
        value += dr.select(seen, _coat(layers, wi_coat, _above(wo_coat), _half(wi_coat, wo_coat)), 0)
    above, shade = _above(about(normals.diffuse, wo)), normals.terminator(wo)
    fibres, diffuse = _fibres(layers, above), _diffuse(layers, about(normals.diffuse, wi), above) * shade
    if layers.sheen_shape is None or layers.sheen_shape.shaded_by_bumps:
        fibres *= shade
    value += dr.select(normals.lit(normals.diffuse, wo), fibres + diffuse, 0)
    if layers.glass is not None and layers.glass_fresnel is not None:
        value += refracted(layers, wo, reachable_only=reachable_only)
    if layers.translucent is not None:
        value += layers.translucent * lambert(_turned_over(wo))
    return value


def _above(wo: Any) -> Any:
    return dr.kind_of(wo)(wo.x, wo.y, dr.maximum(wo.z, 1e-7))


def _half(wi: Any, wo: Any) -> Half:
    """The half vector and its cosine with `wi`."""
    h = dr.normalize(wi + dr.kind_of(wi)(wo.x, wo.y, dr.abs(wo.z)))
    return h, dr.minimum(dr.dot(wi, h), 1)


def _microfacets(layers: Layers, wo: Any, half: Half) -> Any:
    """Metal and specular."""
    if layers.metal is None and layers.specular is None:
        return 0
    h, c = half
    fresnel: Any = 0
    if layers.metal is not None and layers.metal_fresnel is not None:
        fresnel += layers.metal * layers.metal_fresnel(c)
    if layers.specular is not None and layers.specular_fresnel is not None:
        fresnel += layers.specular * layers.specular_fresnel(c)
    return fresnel * reflection(layers.wi, wo, h, layers.ax, layers.ay, layers.facets)


def _coat(layers: Layers, wi: Any, wo: Any, half: Half) -> Any:
    h, c = half
    lobe = reflection(wi, wo, h, layers.coat_alpha, layers.coat_alpha)
    return layers.coat * (lobe * dielectric(c, layers.coat_ior))


def _glass_reflection(layers: Layers, wo: Any, half: Half) -> Any:
    if layers.glass_fresnel is None:
        return 0
    h, c = half
    lobe = reflection(layers.wi, wo, h, layers.glass_alpha, layers.glass_alpha, layers.facets)
    return layers.glass * layers.glass_reflected * layers.glass_fresnel(c) * lobe


def _fibres(layers: Layers, wo: Any) -> Any:
    """Sheen, or what stands in its place: velvet or toon."""
    if layers.sheen is None or layers.sheen_shape is None:
        return 0
    return layers.sheen * layers.sheen_shape.value(wo)


def _diffuse(layers: Layers, wi: Any, wo: Any) -> Any:
    """Diffuse and what stands for subsurface."""
    value: Any = 0
    if layers.diffuse is not None:
        if layers.diffuse_roughness is None:
            value += layers.diffuse * lambert(wo)
        else:
            value += layers.diffuse * oren_nayar(wi, wo, layers.base, layers.diffuse_roughness)
    if layers.subsurface is not None:
        value += layers.subsurface * lambert(wo)
    return value


def refraction_normal(layers: Layers, wo: Any) -> tuple[Any, Any, Any]:
    """Half vector of refraction on the side of the view, (n / length)^2 |wo.h| (the Jacobian dh/dwo), and whether a
    microfacet of that normal really bends `wi` to `wo`."""
    n, wi = layers.glass_ior, layers.wi
    h = -(wi + wo * n)
    squared = dr.maximum(dr.squared_norm(h), 1e-14)
    h = h * dr.rsqrt(squared)
    h = dr.select(h.z < 0, -h, h)
    possible = (dr.dot(wi, h) > 0) & (dr.dot(wo, h) < 0)
    return h, dr.square(n) / squared * dr.abs(dr.dot(wo, h)), possible


def reached(possible: Any, reachable_only: Any) -> Any:
    """Whether a pair counts that a microfacet may connect, or may not; `reachable_only` as in `refracted`."""
    if isinstance(reachable_only, bool):
        return possible | (not reachable_only)
    return possible | ~reachable_only


def refracted(layers: Layers, wo: Any, *, reachable_only: Any = False) -> Any:
    """f_r |cos| of light that comes through the surface from `wo` below it.

    Cycles also evaluates pairs that no microfacet can connect, which its own sampling never reaches, so that they count
    for lights it samples; so does this, unless `reachable_only`, a bool or one for each.
    """
    assert layers.glass_fresnel is not None
    wi, alpha = layers.wi, layers.glass_alpha
    h, jacobian, possible = refraction_normal(layers, wo)
    c = dr.abs(dr.dot(wi, h))
    seen = layers.facets.seen(wi, wo, h, alpha, alpha)
    lobe = layers.facets.density(h, alpha, alpha) * seen * c * jacobian / dr.maximum(wi.z, 1e-7)
    counted = (wo.z < 0) & (wi.z > 0)
    return dr.select(
        counted & reached(possible, reachable_only),
        layers.glass * layers.glass_colour * (1 - layers.glass_fresnel(c)) * lobe,
        0,
    )
