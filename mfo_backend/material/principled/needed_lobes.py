# SPDX-License-Identifier: Apache-2.0
"""Which lobes of the Principled BSDF a material needs; the others are not traced into the kernel."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from ...types.parameter import Value
from .principled_parameters import BLENDER_PRINCIPLED


@dataclass(frozen=True)
class Lobes:
    """The parts of the model that are evaluated; a part that is False counts as absent."""

    dielectric: bool = True  # specular reflection and diffuse
    metal: bool = True
    edge_tint: bool = True  # F82 tint of the metal
    diffuse_roughness: bool = True
    anisotropic: bool = True
    coat: bool = True
    sheen: bool = True
    transmission: bool = True
    thin_film: bool = True
    alpha: bool = True
    subsurface: bool = True

    @property
    def clear(self) -> bool:
        """Whether light goes through by refraction or holes."""
        return self.transmission or self.alpha


ALL_LOBES = Lobes()


def needed_lobes(values: Mapping[str, Value | None], free: Collection[str] = ()) -> Lobes:
    """The lobes that can contribute when the parameters in `free` vary and the others stay at `values`.

    Parameters
    ----------
    values
        Value by parameter name; None for one that varies over the surface. Missing names are at Blender's default.
    free
        Names that a fit may change.
    """

    def may_differ(name: str, value: float) -> bool:
        current = values.get(name, BLENDER_PRINCIPLED[name].default)
        components = current if isinstance(current, tuple) else (current,)
        return name in free or any(c is None or c != value for c in components)

    metal = may_differ("metallic", 0.0)
    return Lobes(
        dielectric=may_differ("metallic", 1.0) and may_differ("transmission_weight", 1.0),
        metal=metal,
        edge_tint=metal and may_differ("specular_tint", 1.0),
        diffuse_roughness=may_differ("diffuse_roughness", 0.0),
        anisotropic=may_differ("anisotropic", 0.0),
        coat=may_differ("coat_weight", 0.0),
        sheen=may_differ("sheen_weight", 0.0),
        transmission=may_differ("transmission_weight", 0.0) and may_differ("metallic", 1.0),
        thin_film=may_differ("thin_film_thickness", 0.0),
        alpha=may_differ("alpha", 1.0),
        subsurface=may_differ("subsurface_weight", 0.0),
    )
