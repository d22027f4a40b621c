# SPDX-License-Identifier: Apache-2.0
"""Albedo of the GGX lobes and the compensation of the energy lost to multiple scattering.

Cycles scales the single-scattering lobe (Turquin 2019, "Practical multiple scattering compensation") instead of adding
one. Roughness is the artist's value, alpha its square.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..arrays import dual as dr
from ..arrays.grid_table import cycles_table
from .fresnel import table_place


@dataclass(frozen=True)
class Compensation:
    """The two factors of a compensated lobe: their product scales the lobe, `weight` alone the albedo of its layer."""

    lobe: Any  # 1 / E
    weight: Any  # E + Fms (1 - E)

    @property
    def scale(self) -> Any:
        """Total factor on the single-scattering lobe."""
        return self.weight * self.lobe


NO_COMPENSATION = Compensation(1.0, 1.0)


def compensation(albedo: Any, average: Any, mean_fresnel: Any) -> Compensation:
    """Factors for a lobe with white albedo E at the view, cosine average Eavg and mean Fresnel reflectance."""
    multiple = mean_fresnel * average / (1 - mean_fresnel * (1 - average))
    return Compensation(dr.rcp(albedo), albedo + multiple * (1 - albedo))


def reflection_albedo(roughness: Any, mu: Any) -> tuple[Any, Any]:
    """E and Eavg of the white reflecting lobe."""
    return cycles_table("ggx_E")(roughness, mu), cycles_table("ggx_Eavg")(roughness)


def glass_albedo(roughness: Any, mu: Any, n: Any, ior: Any) -> tuple[Any, Any]:
    """E and Eavg of the white glass lobe with relative index `n`, which is `ior` or its reciprocal."""
    inverse = dr.select(n < 1, dr.uint32_array_t(type(n))(1), 0)
    z = table_place(ior)  # that of the reciprocal is the same
    albedo = cycles_table("ggx_glass_E", "ggx_glass_inv_E")(roughness, mu, z, choice=inverse)
    average = cycles_table("ggx_glass_Eavg", "ggx_glass_inv_Eavg")(roughness, z, choice=inverse)
    return albedo, average


def schlick_albedo(roughness: Any, mu: Any, n: Any) -> Any:
    """Mean of the Schlick blend over a lobe: albedo of a layer of index `n` is F0 + (1 - F0) times this."""
    return cycles_table("schlick_ior_s")(roughness, mu, table_place(n))
