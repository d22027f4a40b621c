# SPDX-License-Identifier: Apache-2.0
"""The GGX distribution: density, height-correlated masking, visible normals.

Directions are unit vectors in the frame tangent, bitangent, normal; `ax`, `ay` are the squared roughnesses alpha along
tangent and bitangent. Sources: Walter et al. 2007 (distribution, refraction), Heitz 2014 eq. 99 (height-correlated
masking), Heitz 2018 (visible normals), Dupuy and Benyoub 2023 (their sampling by spherical caps).
"""

from __future__ import annotations

from typing import Any

from ..arrays import dual as dr


def density(h: Any, ax: Any, ay: Any) -> Any:
    """D(h), 1/sr."""
    k = dr.square(h.x / ax) + dr.square(h.y / ay) + dr.square(h.z)
    return dr.rcp(dr.pi * ax * ay * dr.square(k))


def smith_lambda(w: Any, ax: Any, ay: Any) -> Any:
    """Lambda(w): 1 / (1 + Lambda) is the visible part of the microfacets that face `w`."""
    slope = (dr.square(ax * w.x) + dr.square(ay * w.y)) / dr.maximum(dr.square(w.z), 1e-14)
    return 0.5 * (dr.sqrt(1 + slope) - 1)


def reflection(wi: Any, wo: Any, h: Any, ax: Any, ay: Any) -> Any:
    """D G2 / (4 mu): f_r |cos| of a white single-scattering lobe, both directions above the surface."""
    g2 = dr.rcp(1 + smith_lambda(wi, ax, ay) + smith_lambda(wo, ax, ay))
    return density(h, ax, ay) * g2 / (4 * dr.maximum(wi.z, 1e-7))


def visible_pdf(wi: Any, h: Any, ax: Any, ay: Any) -> Any:
    """Density of `sample_visible` per solid angle of h: D G1 |wi.h| / mu."""
    return density(h, ax, ay) * dr.abs(dr.dot(wi, h)) / ((1 + smith_lambda(wi, ax, ay)) * dr.maximum(wi.z, 1e-7))


def sample_visible(wi: Any, ax: Any, ay: Any, u: Any) -> Any:
    """A normal among those `wi` sees, from two uniform numbers."""
    vector = type(wi)
    stretched = dr.normalize(vector(ax * wi.x, ay * wi.y, wi.z))
    sin_phi, cos_phi = dr.sincos(2 * dr.pi * u.x)
    z = dr.fma(1 - u.y, 1 + stretched.z, -stretched.z)
    r = dr.safe_sqrt(1 - dr.square(z))
    h = vector(r * cos_phi + stretched.x, r * sin_phi + stretched.y, z + stretched.z)
    return dr.normalize(vector(h.x * ax, h.y * ay, dr.maximum(h.z, 1e-7)))
