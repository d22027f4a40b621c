# SPDX-License-Identifier: Apache-2.0
"""The lobes of a Toon BSDF: the same in a cone about the normal or the mirrored view, less towards its edge.

Source: Cycles, kernel/closure/bsdf_toon.h.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import saturate

LEAST_SIZE = 1e-5  # of a cone, in right angles, as Cycles has it


@dataclass(frozen=True)
class ToonLobe:
    """A cone about the third axis, or where it is `glossy` about what mirrors the view `wi`.

    It shines up to `size` and fades over `smooth`, both in parts of a right angle. It lies over nothing: its `albedo`
    is left at 1.
    """

    wi: Any
    size: Any
    smooth: Any
    glossy: bool = False
    albedo: Any = 1.0

    @property
    def shaded_by_bumps(self) -> bool:
        """Whether the terminator of bumps is for it, as for diffuse lobes in Cycles."""
        return not self.glossy

    def value(self, wo: Any) -> Any:
        """f_r |cos| of a white lobe at `wo` above the surface."""
        angle, full, width = self._angle(wo), self._full, self._width
        fading = 1 - (angle - full) / dr.maximum(width, 1e-12)
        shown = dr.select(angle < full, 1, dr.select((angle < full + width) & (width > 0), fading, 0))
        return self.pdf(wo) * shown

    def pdf(self, wo: Any) -> Any:
        """Density of `sample` per solid angle."""
        inside = (self._angle(wo) < self._reach) & (wo.z >= 0)
        return dr.select(inside, 1 / (2 * dr.pi * self._cap), 0)

    def sample(self, cosine_direction: Any) -> Any:
        """A direction of the cone from a cosine-distributed one."""
        w = cosine_direction
        height = 1 - dr.maximum(1 - dr.square(w.z), 0) * self._cap
        flat = dr.maximum(dr.sqrt(dr.square(w.x) + dr.square(w.y)), 1e-7)
        across = dr.safe_sqrt(1 - dr.square(height)) / flat
        local = type(w)(w.x * across, w.y * across, height)
        if not self.glossy:
            return local
        x, y = _axes(self._middle)
        return local.x * x + local.y * y + local.z * self._middle

    @property
    def _full(self) -> Any:
        return dr.clip(self.size, LEAST_SIZE, 1) * (dr.pi / 2)

    @property
    def _width(self) -> Any:
        return saturate(self.smooth) * (dr.pi / 2)

    @property
    def _reach(self) -> Any:
        return dr.minimum(self._full + self._width, dr.pi / 2)

    @property
    def _cap(self) -> Any:
        """1 - cos of the whole cone."""
        return 2 * dr.square(dr.sincos(0.5 * self._reach)[0])

    @property
    def _middle(self) -> Any:
        return dr.kind_of(self.wi)(-self.wi.x, -self.wi.y, self.wi.z)

    def _angle(self, wo: Any) -> Any:
        cosine = dr.dot(self._middle, wo) if self.glossy else wo.z
        return dr.safe_acos(dr.maximum(cosine, 0))


def _axes(normal: Any) -> tuple[Any, Any]:
    """Two directions that are perpendicular to a unit vector above the surface, and to each other."""
    vector, a = type(normal), 1 / (1 + normal.z)
    b = -normal.x * normal.y * a
    x = vector(1 - dr.square(normal.x) * a, b, -normal.x)
    return x, vector(b, 1 - dr.square(normal.y) * a, -normal.y)
