# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Principled BSDF v2 and Mitsuba's `principled`: from one to the other and back.

The two are different models, so the mapping matches what matters most and leaves a residual. Matched: the diffuse
albedo seen at cos 0.8, the albedo of metal at the same angle (Mitsuba loses the energy of multiple scattering),
F0, roughness, anisotropy, coat strength at normal incidence. Not matched: the shape of the highlight (separable
against height-correlated masking, GTR1 against GGX coat), grazing retro-reflection, coat attenuation of the base,
sheen's lobe. No counterpart: Coat IOR, Coat Tint, thin film, subsurface, diffuse roughness, sheen roughness, the
colour of a tint. Colours are linear Rec.709.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

Values = dict[str, Any]

VIEW_COSINE = 0.8
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])  # Rec.709, as Mitsuba's `luminance`
# albedo of Mitsuba's sheen over Cycles' at sheen roughness 0.5, between cos 0.15 and 0.5
SHEEN_SCALE = 0.15
# Mitsuba's clear coat: 0.25 strength, GTR1 alpha from 0.1 (gloss 0) to 0.001 (gloss 1)
COAT_SCALE = 0.25
COAT_ALPHA_DULL, COAT_ALPHA_GLOSSY = 0.1, 0.001
# sockets whose values Mitsuba's model cannot express, and the value that means "nothing to express"
UNMATCHED = {
    "Subsurface Weight": 0.0,
    "Diffuse Roughness": 0.0,
    "Thin Film Thickness": 0.0,
    "Anisotropic Rotation": 0.0,
    "Thin Wall": False,
    "Absorption Density": 0.0,
}


def sockets_to_mitsuba(sockets: Mapping[str, Any]) -> Values:
    """Map Principled v2 socket values (Blender's defaults where missing) to parameters of Mitsuba's `principled`."""
    base = np.asarray(_get(sockets, "Base Color", (0.8, 0.8, 0.8)), dtype=np.float64)[:3].clip(0.0)
    metallic = _unit(_get(sockets, "Metallic", 0.0))
    roughness = _unit(_get(sockets, "Roughness", 0.5))
    transmission = _unit(_get(sockets, "Transmission Weight", 0.0))
    eta = effective_ior(float(_get(sockets, "IOR", 1.5)), float(_get(sockets, "Specular IOR Level", 0.5)), transmission)
    coat_alpha = _unit(_get(sockets, "Coat Roughness", 0.03)) ** 2
    gloss = (COAT_ALPHA_DULL - coat_alpha) / (COAT_ALPHA_DULL - COAT_ALPHA_GLOSSY)
    return {
        "base_color": tuple(_base_to_mitsuba(base, metallic, roughness, eta, transmission).clip(0.0, 1.0)),
        "metallic": metallic,
        "roughness": roughness,
        "eta": eta,
        "anisotropic": _unit(_get(sockets, "Anisotropic", 0.0)),
        "spec_tint": _tint_weight(_get(sockets, "Specular Tint", (1.0, 1.0, 1.0)), base),
        "sheen": _unit(float(_get(sockets, "Sheen Weight", 0.0)) / SHEEN_SCALE),
        "sheen_tint": _tint_weight(_get(sockets, "Sheen Tint", (1.0, 1.0, 1.0)), base),
        "clearcoat": _unit(float(_get(sockets, "Coat Weight", 0.0)) / COAT_SCALE),
        "clearcoat_gloss": _unit(gloss),
        "spec_trans": transmission,
        "flatness": 0.0,
    }


def mitsuba_to_sockets(values: Mapping[str, Any], sockets_start: Mapping[str, Any]) -> Values:
    """Map parameters of Mitsuba's `principled` to the sockets they determine.

    `values` may hold only some parameters; the others are taken from `sockets_start`. Returned are the sockets that
    the parameters in `values` drive, and of those only the ones that `sockets_start` knows.
    """
    every = {**sockets_to_mitsuba(sockets_start), **values}
    if "specular" in values and "eta" not in values:
        every["eta"] = 2.0 / (1.0 - math.sqrt(0.08 * float(values["specular"]))) - 1.0
    metallic, roughness, eta = float(every["metallic"]), float(every["roughness"]), float(every["eta"])
    base_mitsuba = np.asarray(every["base_color"], dtype=np.float64)
    base = _base_to_blender(base_mitsuba, metallic, roughness, eta, float(every["spec_trans"])).clip(0.0, 1.0)
    sockets: Values = {}
    if {"base_color", "metallic", "roughness", "eta", "specular"} & set(values):
        sockets["Base Color"] = tuple(base)
    simple = {
        "metallic": "Metallic",
        "roughness": "Roughness",
        "anisotropic": "Anisotropic",
        "spec_trans": "Transmission Weight",
    }
    sockets.update({socket: float(values[name]) for name, socket in simple.items() if name in values})
    if {"eta", "specular"} & set(values):
        # level 0.5 leaves F0 and Fresnel curve to the IOR alone
        sockets.update({"IOR": eta, "Specular IOR Level": 0.5})
    if "spec_tint" in values:
        sockets["Specular Tint"] = _tint_color(float(values["spec_tint"]) * (1.0 - metallic), base)
    if "sheen" in values:
        sockets["Sheen Weight"] = SHEEN_SCALE * float(values["sheen"])
    if "sheen_tint" in values:
        sockets["Sheen Tint"] = _tint_color(float(values["sheen_tint"]), base)
    if "clearcoat" in values:
        sockets["Coat Weight"] = COAT_SCALE * float(values["clearcoat"])
    if "clearcoat_gloss" in values:
        alpha = COAT_ALPHA_DULL + (COAT_ALPHA_GLOSSY - COAT_ALPHA_DULL) * float(values["clearcoat_gloss"])
        sockets["Coat Roughness"] = math.sqrt(alpha)
    return {name: value for name, value in sockets.items() if not sockets_start or name in sockets_start}


def effective_ior(ior: float, level: float, transmission: float = 0.0) -> float:
    """Return the IOR whose F0 is that of `ior` scaled by twice `level`; refraction needs `ior` itself."""
    ior = max(ior, 1e-5)
    if transmission > 0.0 or level == 0.5:
        return max(ior, 1.0001)
    f0 = min(((ior - 1.0) / (ior + 1.0)) ** 2 * 2.0 * max(level, 0.0), 0.99)
    root = math.sqrt(f0)
    return max((1.0 + root) / (1.0 - root), 1.0001)


def fresnel(cosine: float, eta: float) -> float:
    """Reflectance of a smooth dielectric for unpolarised light."""
    g = math.sqrt(max(eta * eta - 1.0 + cosine * cosine, 0.0))
    s = ((cosine - g) / (cosine + g)) ** 2
    p = ((eta * eta * cosine - g) / (eta * eta * cosine + g)) ** 2
    return 0.5 * (s + p)


@lru_cache(maxsize=512)
def _ggx_albedos(roughness: float) -> tuple[float, float, float]:
    """Return directional albedos of white GGX at cos 0.8: (height-correlated, separable masking), and the cosine mean.

    The first and last are what Cycles' energy compensation uses, the second is what Mitsuba's metal reflects.
    """
    alpha = max(roughness * roughness, 1e-3)
    joint, separate = _reflected_energy(alpha, VIEW_COSINE)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    cosines = 0.5 * (nodes + 1.0)
    mean = sum(w * c * _reflected_energy(alpha, float(c))[0] for w, c in zip(weights, cosines, strict=True))
    return joint, separate, min(float(mean), 1.0)


def _reflected_energy(alpha: float, mu: float) -> tuple[float, float]:
    """Integrate white GGX reflection by stratified sampling of D * cos (Walter et al. 2007, eq. 35)."""
    u, phi = np.meshgrid((np.arange(96) + 0.5) / 96, (np.arange(48) + 0.5) / 48 * 2.0 * math.pi)
    cos_h = 1.0 / np.sqrt(1.0 + alpha**2 * u / (1.0 - u))
    sin_h = np.sqrt(1.0 - cos_h**2)
    dot = math.sqrt(1.0 - mu * mu) * sin_h * np.cos(phi) + mu * cos_h
    out = 2.0 * dot * cos_h - mu

    def smith(cosine: Any) -> Any:
        return 0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 / np.square(cosine) - 1.0)) - 1.0)

    valid = (dot > 0.0) & (out > 0.0)
    light = smith(np.where(valid, out, 1.0))
    view = float(smith(mu))
    # normals drawn with pdf D cos_h: weight = G (v.h) / (mu cos_h)
    weight = np.where(valid, dot / (mu * cos_h), 0.0)
    joint = float(np.mean(weight / (1.0 + light + view)))
    separate = float(np.mean(weight / ((1.0 + light) * (1.0 + view))))
    return joint, separate


def _metal_to_mitsuba(base: np.ndarray, roughness: float) -> np.ndarray:
    """Metal colour with the same albedo: Cycles scales by 1 + Fms (1 - E) / E, Mitsuba keeps single scattering."""
    joint, separate, mean = _ggx_albedos(roughness)
    multiple = base * mean / (1.0 - base * (1.0 - mean))
    return base * (joint + multiple * (1.0 - joint)) / separate


def _metal_to_blender(base: np.ndarray, roughness: float) -> np.ndarray:
    """Inverse of `_metal_to_mitsuba`: the root of a quadratic."""
    joint, separate, mean = _ggx_albedos(roughness)
    albedo, lost = base * separate, 1.0 - mean
    square = (1.0 - joint) * mean - joint * lost
    linear = joint + albedo * lost
    root = np.sqrt(np.maximum(linear**2 + 4.0 * square * albedo, 0.0))
    return 2.0 * albedo / (linear + root)


def _base_to_mitsuba(base: np.ndarray, metallic: float, roughness: float, eta: float, trans: float) -> np.ndarray:
    diffuse = base * _diffuse_factor(eta, trans)
    return (1.0 - metallic) * diffuse + metallic * _metal_to_mitsuba(base.clip(0.0, 1.0), roughness)


def _base_to_blender(base: np.ndarray, metallic: float, roughness: float, eta: float, trans: float) -> np.ndarray:
    """Invert `_base_to_mitsuba` by bisection: it grows with the base colour."""
    if metallic == 0.0:
        return base / _diffuse_factor(eta, trans)
    if metallic == 1.0:
        return _metal_to_blender(base, roughness)
    low, high = np.zeros(3), np.ones(3)
    for _ in range(50):
        middle = 0.5 * (low + high)
        below = _base_to_mitsuba(middle, metallic, roughness, eta, trans) < base
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def _diffuse_factor(eta: float, trans: float) -> float:
    """Cycles' specular layer takes its share from the diffuse below; Mitsuba's two lobes simply add."""
    return 1.0 - (1.0 - trans) * fresnel(VIEW_COSINE, eta)


def _hue(base: np.ndarray) -> np.ndarray:
    luminance = float(LUMINANCE @ base)
    return base / luminance if luminance > 0.0 else np.ones(3)


def _tint_weight(tint: Any, base: np.ndarray) -> float:
    """Least-squares weight t of lerp(1, hue of the base colour, t) against a Blender tint colour."""
    wanted = np.asarray(tint, dtype=np.float64)[:3] - 1.0
    available = _hue(base) - 1.0
    square = float(available @ available)
    return _unit(float(wanted @ available) / square) if square > 1e-12 else 0.0


def _tint_color(weight: float, base: np.ndarray) -> tuple[float, ...]:
    return tuple((1.0 + weight * (_hue(base) - 1.0)).clip(0.0, 1.0))


def _unit(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)


def _get(sockets: Mapping[str, Any], name: str, default: Any) -> Any:
    value = sockets.get(name)
    return default if value is None else value
