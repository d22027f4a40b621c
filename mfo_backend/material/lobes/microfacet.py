# SPDX-License-Identifier: Apache-2.0
"""Distributions of microfacet normals: density, masking, and the visible normals of GGX.

Directions are unit vectors in the frame tangent, bitangent, normal; `ax`, `ay` are the squared roughnesses alpha along
tangent and bitangent. Sources: Walter et al. 2007 (GGX and Beckmann, refraction; eq. 15 approximates Beckmann's
masking), Heitz 2014 eq. 99 (height-correlated masking), Ashikhmin and Shirley 2000 (theirs, with Cycles' exponents),
Heitz 2018 (visible normals), Dupuy and Benyoub 2023 (their sampling by spherical caps).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..arrays import dual as dr

SHARPEST = 1e-4  # alpha: Ashikhmin-Shirley is no sharper in Cycles
_LEAST_COSINE = 1e-6  # of a normal of Ashikhmin-Shirley, in Cycles


@dataclass(frozen=True)
class Microfacets:
    """A distribution of normals.

    Attributes
    ----------
    density
        D(h), 1/sr, of a normal and the two alphas.
    seen
        G2, the part of the microfacets of normal `h` that both directions see, of `wi`, `wo`, `h` and the alphas.
    """

    density: Callable[[Any, Any, Any], Any]
    seen: Callable[[Any, Any, Any, Any, Any], Any]


def density(h: Any, ax: Any, ay: Any) -> Any:
    """D(h) of GGX, 1/sr."""
    k = dr.square(h.x / ax) + dr.square(h.y / ay) + dr.square(h.z)
    return dr.rcp(dr.pi * ax * ay * dr.square(k))


def smith_lambda(w: Any, ax: Any, ay: Any) -> Any:
    """Lambda(w) of GGX: 1 / (1 + Lambda) is the visible part of the microfacets that face `w`."""
    return 0.5 * (dr.sqrt(1 + _squared_slope(w, ax, ay)) - 1)


def _squared_slope(w: Any, ax: Any, ay: Any) -> Any:
    """(alpha tan theta)^2."""
    return (dr.square(ax * w.x) + dr.square(ay * w.y)) / dr.maximum(dr.square(w.z), 1e-14)


def _seen_ggx(wi: Any, wo: Any, h: Any, ax: Any, ay: Any) -> Any:
    return dr.rcp(1 + smith_lambda(wi, ax, ay) + smith_lambda(wo, ax, ay))


def _density_beckmann(h: Any, ax: Any, ay: Any) -> Any:
    z2 = dr.maximum(dr.square(h.z), 1e-7)
    return dr.exp(-(dr.square(h.x / ax) + dr.square(h.y / ay)) / z2) / (dr.pi * ax * ay * dr.square(z2))


def _lambda_beckmann(w: Any, ax: Any, ay: Any) -> Any:
    slope = _squared_slope(w, ax, ay)
    a = dr.rsqrt(dr.maximum(slope, 0.39))
    return dr.select(slope < 0.39, 0, ((0.396 * a - 1.259) * a + 1) / ((2.181 * a + 3.535) * a))


def _seen_beckmann(wi: Any, wo: Any, h: Any, ax: Any, ay: Any) -> Any:
    return dr.rcp(1 + _lambda_beckmann(wi, ax, ay) + _lambda_beckmann(wo, ax, ay))


def _density_ashikhmin_shirley(h: Any, ax: Any, ay: Any) -> Any:
    """sqrt((nx + 1) (ny + 1)) / (2 pi) cos^e, e = (nx x^2 + ny y^2) / (x^2 + y^2), n = 2 / alpha^2 - 2."""
    nx, ny = (2 * dr.rcp(dr.square(dr.maximum(a, SHARPEST))) - 2 for a in (ax, ay))
    sin2 = dr.square(h.x) + dr.square(h.y)
    # log(1 - s) / s; where s is small the logarithm of a number near 1 has no digits left
    logarithm = dr.log(dr.maximum(1 - sin2, _LEAST_COSINE**2)) / dr.maximum(sin2, 1e-12)
    slope = dr.select(sin2 < 1e-3, -(1 + sin2 * (1 / 2 + sin2 / 3)), logarithm)
    lobe = dr.exp(0.5 * (nx * dr.square(h.x) + ny * dr.square(h.y)) * slope)
    return dr.sqrt((nx + 1) * (ny + 1)) / (2 * dr.pi) * lobe


def _seen_ashikhmin_shirley(wi: Any, wo: Any, h: Any, ax: Any, ay: Any) -> Any:
    """What makes D G2 / (4 mu) the lobe of the paper, without its Fresnel term."""
    return dr.minimum(wi.z, wo.z) / dr.maximum(dr.dot(wi, h), 1e-6)


GGX = Microfacets(density, _seen_ggx)
MICROFACETS = {
    "GGX": GGX,
    "BECKMANN": Microfacets(_density_beckmann, _seen_beckmann),
    "ASHIKHMIN_SHIRLEY": Microfacets(_density_ashikhmin_shirley, _seen_ashikhmin_shirley),
}


def reflection(wi: Any, wo: Any, h: Any, ax: Any, ay: Any, facets: Microfacets = GGX) -> Any:
    """D G2 / (4 mu): f_r |cos| of a white single-scattering lobe, both directions above the surface."""
    seen = facets.seen(wi, wo, h, ax, ay)
    return facets.density(h, ax, ay) * seen / (4 * dr.maximum(wi.z, 1e-7))


def visible_pdf(wi: Any, h: Any, ax: Any, ay: Any) -> Any:
    """Density of `sample_visible` per solid angle of h: D G1 |wi.h| / mu."""
    return density(h, ax, ay) * dr.abs(dr.dot(wi, h)) / ((1 + smith_lambda(wi, ax, ay)) * dr.maximum(wi.z, 1e-7))


def sample_visible(wi: Any, ax: Any, ay: Any, u: Any) -> Any:
    """A normal of GGX among those `wi` sees, from two uniform numbers.

    It serves the other distributions, too: none has a tail as long as that of GGX.
    """
    vector = type(wi)
    stretched = dr.normalize(vector(ax * wi.x, ay * wi.y, wi.z))
    sin_phi, cos_phi = dr.sincos(2 * dr.pi * u.x)
    z = dr.fma(1 - u.y, 1 + stretched.z, -stretched.z)
    r = dr.safe_sqrt(1 - dr.square(z))
    h = vector(r * cos_phi + stretched.x, r * sin_phi + stretched.y, z + stretched.z)
    return dr.normalize(vector(h.x * ax, h.y * ay, dr.maximum(h.z, 1e-7)))
