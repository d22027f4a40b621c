# SPDX-License-Identifier: Apache-2.0
"""The diffuse lobe: energy-preserving Oren-Nayar (Portsmouth, Kutz, Hill 2024), which is Lambert's at roughness 0."""

from __future__ import annotations

from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import saturate

_SLOPE = dr.pi / 2 - 2 / 3
_MEAN_G = (2 * dr.pi - 5.6) / 3


def _directional(x: Any) -> Any:
    """G(x): albedo of the second Oren-Nayar term for cosine x, times pi."""
    sine = dr.safe_sqrt(1 - dr.square(x))
    angle = dr.safe_acos(x)
    tail = (2 / 3) * (sine / dr.maximum(x, 1e-6)) * (1 - sine * dr.square(sine))
    return dr.select(x < 1e-6, _SLOPE - x, sine * (angle - 2 / 3 - sine * x) + tail)


def oren_nayar(wi: Any, wo: Any, base: Any, roughness: Any) -> Any:
    """f_r |cos| of the lobe without the albedo `base` in front of it, RGB; `base` steers the multiple scattering.

    The complement 1 - E of the albedo is b (slope - G); written so, nothing cancels as roughness goes to 0.
    """
    nv, nl = dr.maximum(wi.z, 0), dr.maximum(wo.z, 0)
    a = dr.rcp(dr.pi + roughness * _SLOPE)
    b = roughness * a
    t = dr.dot(wi, wo) - nv * nl
    t = dr.select(t > 0, t / dr.maximum(dr.maximum(nl, nv), 1e-7), t)
    rho = saturate(base)
    lost = b * (_SLOPE - _MEAN_G)
    lost_pair = b * (_SLOPE - _directional(nv)) * (_SLOPE - _directional(nl)) / (_SLOPE - _MEAN_G)
    multiple = dr.square(rho) * ((1 - lost) * lost_pair / dr.pi) / (1 - rho * lost)
    return nl * (a + b * t + multiple)


def lambert(wo: Any) -> Any:
    """f_r |cos| of a white Lambert surface."""
    return dr.maximum(wo.z, 0) / dr.pi
