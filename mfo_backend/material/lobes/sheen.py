# SPDX-License-Identifier: Apache-2.0
"""Sheen: a layer of fibres as one linearly transformed cosine (Zeltner, Burley, Chiang 2022)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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

    def value(self, wo: Any) -> Any:
        """Normalised lobe times cosine at `wo`; integrates to 1 over the hemisphere, so it is its own density."""
        x = self.cos_phi * wo.x + self.sin_phi * wo.y
        y = self.cos_phi * wo.y - self.sin_phi * wo.x
        z = dr.maximum(wo.z, 0)
        q = dr.square(self.a * x + self.b * z) + dr.square(self.a * y) + dr.square(z)
        return z / dr.pi * dr.square(self.a / dr.maximum(q, 1e-12))

    def sample(self, cosine_direction: Any) -> Any:
        """A direction of the lobe from a cosine-distributed one."""
        w = cosine_direction
        x, y = (w.x - self.b * w.z) / self.a, w.y / self.a
        return dr.normalize(type(w)(self.cos_phi * x - self.sin_phi * y, self.sin_phi * x + self.cos_phi * y, w.z))


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
