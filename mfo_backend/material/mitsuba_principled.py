# SPDX-License-Identifier: Apache-2.0
"""Mitsuba's `principled` plugin as one plain, differentiable Dr.Jit function.

Formulas: B. Burley, "Physically Based Shading at Disney" (2012) and its extension to a BSDF (2015), in the form of
Mitsuba 3.9.1 (`principled.cpp`, `principledhelpers.h`, `microfacet.h`, `fresnel.h`). All reflecting lobes on the front
side; no transmission. Unlike the plugin no lobe is masked by "parameter > 0", so derivatives exist at the bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

import mitsuba as mi

from ..types.errors import UnrecordableError
from ..types.parameter import ParameterTable, Value
from .arrays import dual as dr
from .mitsuba_parameters import MITSUBA_PRINCIPLED

Scalar = Any  # mi.Float or a Python float; a float of exactly 0 leaves its lobe out of the kernel


def _is_zero(value: Scalar) -> bool:
    return isinstance(value, float) and value == 0.0


def _schlick_weight(cosine: Any) -> Any:
    m = dr.clip(1.0 - cosine, 0.0, 1.0)
    return dr.square(dr.square(m)) * m


def _fresnel_dielectric(cosine: Any, eta: Any) -> Any:
    """Unpolarised reflectance of a dielectric from outside, eta > 1 (`fresnel.h`)."""
    cos_t = dr.safe_sqrt(1.0 - (1.0 - dr.square(cosine)) / dr.square(eta))
    a_s = (cosine - eta * cos_t) / (cosine + eta * cos_t)
    a_p = (cos_t - eta * cosine) / (cos_t + eta * cosine)
    return 0.5 * (dr.square(a_s) + dr.square(a_p))


def _smith_ggx(v: Any, alpha_x: Any, alpha_y: Any) -> Any:
    """Shadowing of one direction, GGX."""
    slope = (dr.square(alpha_x * v.x) + dr.square(alpha_y * v.y)) / dr.square(v.z)
    return 2.0 / (1.0 + dr.sqrt(1.0 + slope))


class MitsubaPrincipled:
    """The model `mitsuba_principled`: its parameter table and its evaluation."""

    name: str = "mitsuba_principled"
    table: ParameterTable = MITSUBA_PRINCIPLED
    normals: ParameterTable = ParameterTable(())
    walks: ParameterTable = ParameterTable(())
    # what a global start scans instead of solving for: the first is the lobe width, the others are optional
    scanned: tuple[str, ...] = ("roughness", "clearcoat_gloss")
    two_sided: bool = False  # the plugin needs the wrapper `twosided`
    limited_width: bool = False
    widths: tuple[str, ...] = ("roughness",)

    def values(self, given: Mapping[str, Value | None], free: Collection[str]) -> dict[str, Value | None]:
        """All values `evaluate` needs besides the free ones, from those of a material; missing ones are the plugin's
        defaults.

        Raises
        ------
        UnrecordableError
            If the material transmits light.
        """
        if "spec_trans" in free or given.get("spec_trans", 0.0) != 0.0:
            raise UnrecordableError("The material has 'spec_trans', which recorded paths do not hold.")
        unused = {"spec_trans", "specular" if "eta" in {*given, *free} else "eta", *free}
        return {p.name: given.get(p.name, p.default) for p in self.table if p.name not in unused}

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Callable[[Mapping, Any, Any], Any]:
        """`evaluate`, which leaves out by itself what is exactly 0."""
        return self.evaluate

    def buffers(self) -> list[Any]:
        """It reads no tables."""
        return []

    def evaluate(self, parameters: Mapping[str, Scalar], wi: mi.Vector3f, wo: mi.Vector3f) -> mi.Color3f:
        """Value of the BSDF times the cosine of `wo`, linear Rec.709; zero unless both directions are in front.

        Parameters
        ----------
        parameters
            A value for every name of `table` but `spec_trans`, with one of `specular` and `eta`: `mi.Float` or
            `mi.Color3f` of width 1 or n, or Python floats.
        wi, wo
            Unit directions in the shading frame, towards camera and light.
        """
        p = parameters
        base = dr.cast(mi.Color3f, p["base_color"])
        metallic = p["metallic"]
        dielectric = 1.0 - metallic
        cos_i, cos_o = wi.z, wo.z
        front = (cos_i > 0.0) & (cos_o > 0.0)
        half = dr.normalize(wi + wo)
        half = dr.select(half.z < 0.0, -half, half)
        cos_d = dr.dot(wi, half)
        weight_d = _schlick_weight(dr.abs(cos_d))
        tinted = not (_is_zero(p["spec_tint"]) and (_is_zero(p["sheen"]) or _is_zero(p["sheen_tint"])))
        tint = self._tint(base) if tinted else mi.Color3f(1.0)

        value = self._specular(p, base, tint, dielectric, wi, wo, half, cos_d, weight_d)
        value += dielectric * cos_o * self._diffuse(p, base, cos_i, cos_o, dr.dot(wo, half))
        if not _is_zero(p["sheen"]):
            value += p["sheen"] * dielectric * weight_d * cos_o * dr.lerp(mi.Color3f(1.0), tint, p["sheen_tint"])
        if not _is_zero(p["clearcoat"]):
            value += p["clearcoat"] * self._clearcoat(p["clearcoat_gloss"], wi, wo, half, weight_d)
        return dr.select(front, value, 0.0)

    @staticmethod
    def _tint(base: mi.Color3f) -> mi.Color3f:
        luminance = dr.luminance(base)
        return dr.select(luminance > 0.0, base / luminance, 1.0)

    @staticmethod
    def _specular(p: Mapping, base: Any, tint: Any, dielectric: Any, wi: Any, wo: Any, half: Any, cos_d: Any, w: Any):
        # eta(specular) has normal reflectance 0.08 * specular (`principled.cpp`)
        eta = p["eta"] if "eta" in p else 2.0 / (1.0 - dr.sqrt(0.08 * p["specular"])) - 1.0
        fresnel = dr.cast(mi.Color3f, dielectric * (1.0 - p["spec_tint"]) * _fresnel_dielectric(cos_d, eta))
        if not _is_zero(p["metallic"]):
            fresnel += p["metallic"] * dr.lerp(base, mi.Color3f(1.0), w)
        if not _is_zero(p["spec_tint"]):
            f0 = tint * ((eta - 1.0) / (eta + 1.0)) ** 2
            fresnel += dielectric * p["spec_tint"] * dr.lerp(f0, mi.Color3f(1.0), w)
        alpha = dr.square(p["roughness"])
        if _is_zero(p["anisotropic"]):
            alpha_x = alpha_y = dr.maximum(0.001, alpha)
        else:
            aspect = dr.sqrt(1.0 - 0.9 * p["anisotropic"])
            alpha_x, alpha_y = dr.maximum(0.001, alpha / aspect), dr.maximum(0.001, alpha * aspect)
        slope = dr.square(half.x / alpha_x) + dr.square(half.y / alpha_y) + dr.square(half.z)
        D = 1.0 / (dr.pi * alpha_x * alpha_y * dr.square(slope))
        G = _smith_ggx(wi, alpha_x, alpha_y) * _smith_ggx(wo, alpha_x, alpha_y)
        return fresnel * (D * G / (4.0 * dr.abs(wi.z)))

    @staticmethod
    def _diffuse(p: Mapping, base: Any, cos_i: Any, cos_o: Any, cos_d: Any) -> mi.Color3f:
        wo, wi = _schlick_weight(cos_o), _schlick_weight(cos_i)
        retro = 2.0 * p["roughness"] * dr.square(cos_d)
        lobe = (1.0 - 0.5 * wi) * (1.0 - 0.5 * wo) + retro * (wo + wi + wo * wi * (retro - 1.0))
        if not _is_zero(p["flatness"]):
            half_retro = 0.5 * retro
            fss = (1.0 + (half_retro - 1.0) * wo) * (1.0 + (half_retro - 1.0) * wi)
            flat = 1.25 * (fss * (1.0 / (dr.abs(cos_o) + dr.abs(cos_i)) - 0.5) + 0.5)
            lobe = lobe + p["flatness"] * (flat - lobe)
        return base * (lobe * dr.inv_pi)

    @staticmethod
    def _clearcoat(gloss: Scalar, wi: Any, wo: Any, half: Any, weight: Any) -> Any:
        """A quarter of GTR1 (alpha 0.1 to 0.001) with normal reflectance 0.04 and fixed shadowing (alpha 0.25)."""
        alpha2 = dr.square(0.1 + (0.001 - 0.1) * gloss)
        D = (alpha2 - 1.0) / (dr.pi * dr.log(alpha2) * (1.0 + (alpha2 - 1.0) * dr.square(half.z)))
        G = _smith_ggx(wi, 0.25, 0.25) * _smith_ggx(wo, 0.25, 0.25)
        return 0.25 * (0.04 + 0.96 * weight) * D * G * wo.z
