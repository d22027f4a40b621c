# SPDX-License-Identifier: Apache-2.0
"""Sheen: a layer of fibres as one linearly transformed cosine (Zeltner, Burley, Chiang 2022), or Ashikhmin's velvet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from ..arrays import dual as dr
from ..arrays.grid_table import cycles_table


@dataclass(frozen=True)
class SheenLobe:
    """Transform (a, b) and albedo of the fibres as the view sees them; (cos, sin) is the azimuth of the view."""

    a: Any
    b: Any
    albedo: Any
    cos_phi: Any
    sin_phi: Any
    shaded_by_bumps: ClassVar[bool] = True

    def value(self, wo: Any) -> Any:
        """Normalised lobe times cosine at `wo`; integrates to 1 over the hemisphere."""
        x = self.cos_phi * wo.x + self.sin_phi * wo.y
        y = self.cos_phi * wo.y - self.sin_phi * wo.x
        z = dr.maximum(wo.z, 0)
        q = dr.square(self.a * x + self.b * z) + dr.square(self.a * y) + dr.square(z)
        return z / dr.pi * dr.square(self.a / dr.maximum(q, 1e-12))

    def pdf(self, wo: Any) -> Any:
        """Density of `sample` per solid angle."""
        return self.value(wo)

    def sample(self, cosine_direction: Any) -> Any:
        """A direction of the lobe from a cosine-distributed one."""
        w = cosine_direction
        x, y = (w.x - self.b * w.z) / self.a, w.y / self.a
        return dr.normalize(type(w)(self.cos_phi * x - self.sin_phi * y, self.sin_phi * x + self.cos_phi * y, w.z))


@dataclass(frozen=True)
class VelvetLobe:
    """The velvet of M. Ashikhmin, "Distribution-based BRDFs" (2007), with the Gaussian normals and masking of Cycles.

    It stands alone in a node, so that its `albedo`, which lies over nothing, is left at 1.
    """

    wi: Any
    sigma: Any
    albedo: Any = 1.0
    shaded_by_bumps: ClassVar[bool] = False  # Cycles counts it among glossy lobes, though its bounces are diffuse

    def value(self, wo: Any) -> Any:
        """D G / (4 mu) at `wo`, the cosine included; none where it or the view is below a surface that nodes bend."""
        h = dr.normalize(self.wi + wo)
        cosine = dr.maximum(dr.dot(self.wi, h), 1e-5)
        sin2 = dr.maximum(dr.square(h.x) + dr.square(h.y), 1e-7)
        inverse = dr.rcp(dr.square(dr.maximum(self.sigma, 0.01)))
        normals = dr.exp(-dr.square(h.z) / sin2 * inverse) * inverse / (dr.pi * dr.square(sin2))
        masking = dr.minimum(1, 2 * h.z / cosine * dr.minimum(self.wi.z, wo.z))
        value = normals * masking / (4 * dr.maximum(self.wi.z, 1e-7))
        return dr.select((self.wi.z > 0) & (wo.z > 0) & (h.z < 1 - 1e-5), value, 0)

    def pdf(self, wo: Any) -> Any:
        """Density of `sample` per solid angle."""
        return dr.maximum(wo.z, 0) / dr.pi

    def sample(self, cosine_direction: Any) -> Any:
        """That direction: no factor of the lobe is larger than what masking leaves of the cosine."""
        return cosine_direction


def sheen_lobe(wi: Any, roughness: Any) -> SheenLobe:
    """The lobe seen from `wi`. Black where Cycles drops it: an albedo or a scale below 1e-5."""
    place = dr.maximum(roughness, 1e-3)
    a, b, albedo = (cycles_table("sheen_ltc", plane=k)(wi.z, place) for k in range(3))
    seen = (dr.abs(a) >= 1e-5) & (albedo >= 1e-5)
    sine = dr.sqrt(dr.square(wi.x) + dr.square(wi.y))
    tilted = sine > 1e-7
    scale = dr.rcp(dr.maximum(sine, 1e-7))
    return SheenLobe(
        a=dr.select(seen, a, 1),
        b=dr.select(seen, b, 0),
        albedo=dr.select(seen, albedo, 0),
        cos_phi=dr.select(tilted, wi.x * scale, 1),
        sin_phi=dr.select(tilted, wi.y * scale, 0),
    )
